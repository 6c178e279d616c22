"""`python -m farhand`: the same as the command `farhand`."""

import sys

from farhand.deploy.entry import run

if __name__ == "__main__":
    sys.exit(run())
