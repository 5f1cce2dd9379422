"""Recorded commands computed again: the law on the recorded odometry and reference, compared bit for bit.

It goes through `ControlLoop`, as the node does, with the parameters that travel in the bag.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.bags import run_from_bag
from vessel_hsmc_ros.bags.reader import Bag
from vessel_hsmc_ros.control.control_loop import ControlLoop
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.kinematics import as_acceleration, as_motion
from vessel_hsmc_ros.core.timing import RateGrid, seconds
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law, make_observer

Array = NDArray[np.float64]

TOPICS = ("odom", "reference", "cmd_wrench")
SURGE_AND_YAW = [0, 2]


@dataclass(frozen=True)
class Verification:
    """How recorded commands compare with computed ones.

    Attributes:
        time: s since the first odometry message, of every command compared, (n,).
        recorded, computed: Surge force [N] and yaw moment [N·m], (n, 2).
        beyond: Odometry messages after the last one whose command and reference are in the bag, as in one that was cut off.
    """

    time: Array
    recorded: Array
    computed: Array
    beyond: int

    @property
    def largest(self) -> tuple[float, float]:
        """The largest absolute differences, N and N·m; NaN where only one of the two is a number."""
        both = np.isnan(self.recorded) & np.isnan(self.computed)
        apart = np.where(both, 0.0, np.abs(self.recorded - self.computed))
        surge, yaw = (float(np.max(column, initial=0.0)) for column in apart.T)
        return surge, yaw

    @property
    def differing(self) -> NDArray[np.intp]:
        """The commands that are not the same to the last bit."""
        same = self.recorded.view(np.uint64) == self.computed.view(np.uint64)
        found: NDArray[np.intp] = np.flatnonzero(~same.all(axis=1))
        return found


def verify(bag: Bag, scenario: Scenario, namespace: str | None = None) -> Verification:
    """Compute every command of a recorded lockstep run again.

    Args:
        bag: With `odom`, `reference` and `cmd_wrench`.
        scenario: The bag's own, or a changed one to see the difference.
        namespace: The vessel's, where the bag has several.

    Raises:
        BagError: the bag lacks a topic, or was recorded in real time.
        ControlError: the law has no value for a recorded input.
    """
    if not scenario.controller.lockstep:
        raise BagError(f"bag {bag.path} is of a real-time run: which odometry a command answered is known in lockstep only")
    prefix = bag.namespace(namespace)
    for name in TOPICS:
        if not bag.topics.get(prefix + name):
            raise BagError(f"bag {bag.path} has no message on {prefix}{name}")
    bag.load(*(prefix + name for name in TOPICS))
    odometry, reference, command = (bag.topics[prefix + name] for name in TOPICS)
    order = np.argsort(odometry.stamp, kind="stable")
    stamps, states = odometry.stamp[order], run_from_bag.states(odometry)[order]
    answers, answered = run_from_bag.matched(stamps, command)
    if not answered.any():
        raise BagError(f"bag {bag.path} has no command that answers an odometry message")
    last = int(np.flatnonzero(answered)[-1]) + 1
    steps = _steps(scenario, stamps[:last], states, run_from_bag.inputs_at(stamps[:last], reference))
    computed = np.array([*steps]).reshape(-1, 2)
    chosen = np.flatnonzero(answered[: len(computed)])
    if not len(chosen):
        raise BagError(f"bag {bag.path} has no reference for its first odometry message")
    recorded = np.ascontiguousarray(run_from_bag.wrenches(command)[answers[chosen]][:, SURGE_AND_YAW])
    time = run_from_bag.seconds_of(stamps[chosen] - stamps[0])
    return Verification(time, recorded, computed[chosen], len(stamps) - len(computed))


def _steps(
    scenario: Scenario, stamps: NDArray[np.int64], states: Array, inputs: tuple[NDArray[np.bool_], Array, Array]
) -> Iterator[tuple[float, float]]:
    """The wrench that answers each odometry message, as the node would give it, up to where a reference is missing."""
    controller = scenario.controller
    loop = ControlLoop(make_law(controller), RateGrid(controller.rate_hz), make_observer(controller))
    known, references, accelerations = inputs
    for row, stamp in enumerate(stamps.tolist()):
        if loop.due(stamp):
            if not known[row]:
                return
            loop.step(stamp, as_motion(states[row]), as_motion(references[row]), as_acceleration(accelerations[row]))
        yield loop.wrench


def retuned_at(bag: Bag, namespace: str | None = None) -> list[float]:
    """When the controller's parameters were changed while it was recorded, log times in s."""
    if "/parameter_events" not in bag.topics:
        return []
    name = f"{bag.namespace(namespace)}controller"
    return [seconds(t) for _, t, m in bag.messages("/parameter_events") if m.node == name and len(m.changed_parameters)]
