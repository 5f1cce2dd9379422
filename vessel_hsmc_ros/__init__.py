"""Hierarchical sliding-mode control of underactuated ships over ROS 2: the control side of the package."""

__version__ = "0.1.0"
