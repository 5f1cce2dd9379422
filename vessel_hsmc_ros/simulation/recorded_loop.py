"""The controller over recorded inputs: the law and the observer without the plant, compiled where it pays."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.control_loop import ControlLoop
from vessel_hsmc_ros.control.observer import Observer
from vessel_hsmc_ros.control.observer_filter import ObserverConstants, ObserverState, estimate, observe
from vessel_hsmc_ros.control.pivot import Pivot, carry
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_motion
from vessel_hsmc_ros.laws.kernel_law import KernelLaw
from vessel_hsmc_ros.simulation.closed_loop import law_step, unobserved
from vessel_hsmc_ros.simulation.compilation import available, compiled
from vessel_hsmc_ros.simulation.undefined import cause, is_compilable

Array = NDArray[np.float64]

FEW = 5000
"""Fewer steps are interpreted: that takes less time than to load the compiled law."""


class Recorded(NamedTuple):
    """Recorded inputs of the controller, a row for each odometry message, and the wrenches that it answers.

    Attributes:
        stamp: Times, (n,) ns.
        due: Whether a control period begins, (n,).
        motion, desired: x, y, psi, u, v, r of ship and reference, (n, 6).
        acceleration: du, dv, dr of the reference, (n, 3).
        wrench: Commanded surge force [N] and yaw moment [N·m], (n, 2), to be written.
    """

    stamp: NDArray[np.int64]
    due: NDArray[np.bool_]
    motion: Array
    desired: Array
    acceleration: Array
    wrench: Array


class Answered(NamedTuple):
    """How far the controller has come, and what it leaves to the next step."""

    row: int
    wrench: tuple[float, float]
    memory: Any
    observer: ObserverState
    delta: float


@kernel
def motion_of(rows: Array, k: int) -> Motion:
    """A row as a motion."""
    return Motion(rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4], rows[k, 5])


@kernel
def answer(last: Answered, stop: int, law: Any, observer: ObserverConstants, pivot: Pivot, recorded: Recorded) -> Answered:
    """Answer the messages from the row that the last call has come to up to row stop - 1.

    Args:
        last: What the step before has left; its arrays are written in place.
        stop: Row to stop at.
        law, observer: Constants of the law and of the observer.
        pivot: The point that the law controls.
        recorded: Inputs and answers.

    Returns:
        What the last step has left; its row is below `stop` where the law has no finite wrench.
    """
    start, wrench, memory, observed, delta = last
    for k in range(start, stop):
        if recorded.due[k]:
            motion = motion_of(recorded.motion, k)
            if observer.enabled:
                observed = observe(recorded.stamp[k], (motion.x, motion.y, motion.psi), wrench, observed, observer)
                motion = estimate(observed)
            rate = Acceleration(recorded.acceleration[k, 0], recorded.acceleration[k, 1], recorded.acceleration[k, 2])
            at = carry(motion, motion_of(recorded.desired, k), rate, delta, pivot)
            demand, _, memory = law_step(at.motion, at.desired, at.acceleration, memory, law)
            if not (math.isfinite(demand[0]) and math.isfinite(demand[1])):
                return Answered(k, wrench, memory, observed, delta)
            wrench, delta = demand, at.delta
        recorded.wrench[k, 0], recorded.wrench[k, 1] = wrench
    return Answered(stop, wrench, memory, observed, delta)


def serve(loop: ControlLoop, idle: Observer, recorded: Recorded, span: range, interpreted: bool = False) -> None:
    """Answer a span of recorded messages, and leave law, observer and wrench of the loop as they are then.

    Args:
        loop: The controller.
        idle: An observer that is switched off, for a loop without one.
        recorded: Inputs and answers.
        span: The rows.
        interpreted: Run interpreted in any case.

    Raises:
        ControlError: the law is not defined for a recorded input.
    """
    law = loop.law
    if (
        interpreted
        or not loop.enabled
        or len(span) < FEW
        or not isinstance(law, KernelLaw)
        or not is_compilable(type(law))
        or not available()
    ):
        _serve_interpreted(loop, recorded, span)
        return
    observer = loop.observer or idle
    kernels = {"law_step": type(law).kernel} | ({} if loop.observer else {"observe": unobserved})
    run = compiled(answer, f"the law {law.name} for recorded inputs", allocates=loop.observer is not None, **kernels)
    before = Answered(span.start, loop.wrench, law.memory, observer.state, loop.delta)
    after = run(before, span.stop, law.constants, observer.constants, loop.pivot, recorded)
    law.memory, observer.state, loop.wrench, loop.delta = after.memory, after.observer, after.wrench, after.delta
    if (k := after.row) < span.stop:
        motion = loop.observer.estimate if loop.observer else as_motion(recorded.motion[k])
        rate = as_acceleration(recorded.acceleration[k])
        at = carry(motion, as_motion(recorded.desired[k]), rate, loop.delta, loop.pivot)
        raise cause(law, at.motion, at.desired, at.acceleration)


def _serve_interpreted(loop: ControlLoop, recorded: Recorded, span: range) -> None:
    for k in span:
        if recorded.due[k]:
            motion, desired = as_motion(recorded.motion[k]), as_motion(recorded.desired[k])
            loop.step(int(recorded.stamp[k]), motion, desired, as_acceleration(recorded.acceleration[k]))
        recorded.wrench[k] = loop.wrench
