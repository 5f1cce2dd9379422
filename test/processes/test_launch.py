"""The launch file, launched: needs the launch libraries of a ROS install, which are not among the wheels."""

import unittest

import pytest

pytest.importorskip("launch_ros", reason="launch_ros comes with a ROS install only; test_run.py makes the same assertions")
launch_testing = pytest.importorskip("launch_testing", reason="launch_testing comes with a ROS install only")

from launch import LaunchDescription  # noqa: E402
from launch.actions import IncludeLaunchDescription  # noqa: E402
from launch.launch_description_sources import PythonLaunchDescriptionSource  # noqa: E402
