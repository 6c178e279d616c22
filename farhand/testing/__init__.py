"""Checks of a driver for its author: `check_plant` and `check_arm` move as the control loop does, the other two look.

Each raises one AssertionError with all findings. Clear a machine's way first: it moves. `python -m farhand.testing --help` checks
drivers that are installed, by their names.
"""

from farhand.testing.arm_and_camera import check_arm, check_camera
from farhand.testing.plant_and_sight import check_perception, check_plant

__all__ = ["check_arm", "check_camera", "check_perception", "check_plant"]
