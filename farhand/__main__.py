"""`python -m farhand`: the same as the command `farhand`."""

from farhand.deploy.cli import main

if __name__ == "__main__":
    main()
