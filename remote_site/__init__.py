"""The robot's site: supervision, perception, reproduction, the plant."""
