"""The reference that goes to goals: holder of the memory of the kernels in goal.py."""

import math

import numpy as np

from vessel_hsmc_ros.reference.goal import (
    GoalConstants,
    GoalMemory,
    follow,
    move,
    present_target,
    read,
    set_goal,
    set_scheduled,
)
from vessel_hsmc_ros.reference.goal_parameters import GoalParameters, scheduled_goals
from vessel_hsmc_ros.reference.kernel_reference import KernelReference
from vessel_hsmc_ros.reference.motion_filter import Filter, Filtered
from vessel_hsmc_ros.reference.target import Target, stationary

ASTERN = 1.2
"""Distance up to which goals are approached astern, in radii of gyration, unless it is set."""


def goal_constants(motion: Filter, parameters: GoalParameters) -> GoalConstants:
    """The constants of a goal reference.

    Args:
        motion: The motion filter.
        parameters: Scheduled goals.

    Raises:
        ParameterError: poses and times of the goals differ in number, or the times do not increase.
    """
    goals = [(round(time / motion.period), pose) for time, pose in scheduled_goals(parameters) if time >= 0.0]
    poses = np.array([pose for _, pose in goals], np.float64).reshape(-1, 3)
    given = float(parameters.astern_distance)
    astern = given if given >= 0.0 else ASTERN * motion.length
    return GoalConstants(motion, astern, np.array([step for step, _ in goals], np.int64), poses)


def keeping(start: Filtered, c: GoalConstants) -> GoalMemory:
    """The memory at the start, with the initial position as goal unless another is scheduled."""
    target = stationary(start.x, start.y, start.psi, -math.inf, math.nan)
    return set_scheduled(GoalMemory(start, target, True, start.psi, 1.0, 0), c)


class GoalReference(KernelReference):
    """A feasible motion to the latest goal; before the first goal it keeps its initial position.

    Args:
        start: Initial state.
        motion: The motion filter.
        parameters: Scheduled goals.

    Raises:
        ParameterError: poses and times of the goals differ in number, or the times do not increase.
    """

    move, read, follow = staticmethod(move), staticmethod(read), staticmethod(follow)

    def __init__(self, start: Filtered, motion: Filter, parameters: GoalParameters) -> None:
        self.constants = goal_constants(motion, parameters)
        self._start = start
        self.reset()

    def reset(self) -> None:
        """Return to the start: goals that were set are discarded, scheduled goals begin again."""
        self.memory = keeping(self._start, self.constants)

    def set_goal(self, x: float, y: float, psi: float, stamp: float | None = None) -> None:
        """Set a goal; goals that follow each other shortly define a moving goal.

        Args:
            x, y: Position, m.
            psi: Heading, rad.
            stamp: Time of the measurement, s; None if it is unknown, then the present time counts.
        """
        self.memory = set_goal(self.memory, x, y, psi, math.nan if stamp is None else stamp, self.constants)

    def target(self) -> Target:
        """The present goal: extrapolated while a stream continues, stationary after its end."""
        target, self.memory = present_target(self.memory, self.constants)
        return target
