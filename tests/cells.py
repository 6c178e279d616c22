"""Arm that comes with Farhand in front of its receptacle, for tests; one with other dimensions by `structs.replace`."""

from __future__ import annotations

from farhand.common.arm.cell import Cell
from farhand.deploy.places import find_robot

JACO = Cell(robot=find_robot("jaco"))
