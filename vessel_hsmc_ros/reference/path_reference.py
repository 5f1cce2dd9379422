"""The reference that follows paths: holder of the memory of the kernels in path.py."""

from collections.abc import Sequence

import numpy as np

from vessel_hsmc_ros.core.exceptions import GoalError
from vessel_hsmc_ros.reference.goal_parameters import GoalParameters
from vessel_hsmc_ros.reference.goal_reference import goal_constants, keeping
from vessel_hsmc_ros.reference.kernel_reference import KernelReference
from vessel_hsmc_ros.reference.motion_filter import Filter, Filtered
from vessel_hsmc_ros.reference.path import PathConstants, PathMemory, follow, move, read, set_path
from vessel_hsmc_ros.reference.path_parameters import PathParameters, Point, points_of


class PathReference(KernelReference):
    """A feasible motion along waypoints; before the first path it keeps its initial position.

    Args:
        start: Initial state.
        motion: The motion filter.
        parameters: Scheduled path.
        goal: Parameters of the approach to the last waypoint.

    Raises:
        ParameterError: the number of coordinates is odd.
    """

    move, read, follow = staticmethod(move), staticmethod(read), staticmethod(follow)

    def __init__(self, start: Filtered, motion: Filter, parameters: PathParameters, goal: GoalParameters) -> None:
        points, time = np.array(points_of(parameters), np.float64).reshape(-1, 2), parameters.time
        due = round(time / motion.period) if time >= 0.0 else -1
        unscheduled = goal_constants(motion, GoalParameters(astern_distance=goal.astern_distance))
        self.constants = PathConstants(unscheduled, float(parameters.radius), due, points)
        self._start = start
        self.reset()

    def reset(self) -> None:
        """Return to the start: a path that was set is discarded, the scheduled path begins again."""
        here = np.array([[self._start.x, self._start.y]])
        self.memory = PathMemory(keeping(self._start, self.constants.goal), here, 0)
        if self.constants.due == 0:
            self.memory = set_path(self.memory, self.constants.points, self.constants)

    def set_path(self, points: Sequence[Point]) -> None:
        """Set a new path; its first leg begins at the present position of the reference.

        Args:
            points: Waypoints x, y, m.

        Raises:
            GoalError: there are no waypoints.
        """
        if not points:
            raise GoalError("a path of 0 waypoints is not allowed: it takes at least one")
        self.memory = set_path(self.memory, np.array(points, np.float64), self.constants)
