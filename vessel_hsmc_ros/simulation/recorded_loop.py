"""The controller over recorded inputs: the law and the observer without the plant, compiled where it pays."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.control_loop import ControlLoop
from vessel_hsmc_ros.control.observer import Observer
from vessel_hsmc_ros.control.observer_filter import ObserverConstants, ObserverState, estimate, observe
from vessel_hsmc_ros.control.pivot import Heading, Pivot, carry
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.delay_line import DelayLine, delayed, put
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_motion, extrapolate
from vessel_hsmc_ros.law.kernel_law import KernelLaw
from vessel_hsmc_ros.simulation.closed_loop import law_outdated, law_step, unobserved
from vessel_hsmc_ros.simulation.compilation import available, compiled
from vessel_hsmc_ros.simulation.law_call import cause, is_compilable, law_call

FEW = 5000
"""Fewer steps are interpreted: that takes less time than to load the compiled law."""


class Recorded(NamedTuple):
    """Recorded inputs of the controller, a row for each odometry message, and the wrenches that it answers.

    Attributes:
        stamp: Times of the steps that the messages belong to, (n,) ns.
        due: Whether a control period begins, (n,).
        measured_at: Times of the measurements, (n,) ns.
        age: How much older than the messages' steps they are, (n,) s.
        behind: The same in control periods, rounded, (n,).
        motion, desired: x, y, psi, u, v, r of ship and reference, (n, 6).
        acceleration: du, dv, dr of the reference, (n, 3).
        wrench: Commanded surge force [N] and yaw moment [N·m], (n, 2), to be written.
    """

    stamp: NDArray[np.int64]
    due: NDArray[np.bool_]
    measured_at: NDArray[np.int64]
    age: Array
    behind: NDArray[np.int64]
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
    delta: Heading
    commands: DelayLine


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
        What the last step has left; its row is below `stop` where the law has no finite wrench, or needs other constants.
    """
    start, wrench, memory, observed, delta, commands = last
    for k in range(start, stop):
        if recorded.due[k]:
            motion = motion_of(recorded.motion, k)
            if observer.enabled:
                q = recorded.behind[k]
                then = delayed(commands, q, 0), delayed(commands, q, 1)
                observed = observe(recorded.measured_at[k], (motion.x, motion.y, motion.psi), then, observed, observer)
                motion = estimate(observed)
            rate = Acceleration(recorded.acceleration[k, 0], recorded.acceleration[k, 1], recorded.acceleration[k, 2])
            age = recorded.age[k]
            at = carry(motion, extrapolate(motion_of(recorded.desired, k), rate, -age), rate, delta, pivot)
            demand, _, memory = law_step(at, age, memory, law)
            if not (math.isfinite(demand[0]) and math.isfinite(demand[1])):
                return Answered(k, wrench, memory, observed, delta, commands)
            wrench, delta = demand, at.delta
            if observer.enabled:
                put(commands, wrench)
            if law_outdated(memory, law):
                recorded.wrench[k, 0], recorded.wrench[k, 1] = wrench
                return Answered(k + 1, wrench, memory, observed, delta, commands)
        recorded.wrench[k, 0], recorded.wrench[k, 1] = wrench
    return Answered(stop, wrench, memory, observed, delta, commands)


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
    few = interpreted or len(span) < FEW
    if few or not isinstance(law, KernelLaw) or not is_compilable(type(law)) or not available():
        _serve_interpreted(loop, recorded, span)
        return
    # What a person has commanded, and the handover after it, are not compiled.
    span = _serve_interpreted(loop, recorded, span, until_law=True)
    if not span:
        return
    observer = loop.observer or idle
    kernels = {"law_step": law_call(type(law)), "law_outdated": law.outdated} | ({} if loop.observer else {"observe": unobserved})
    run = compiled(answer, f"the law {law.name} for recorded inputs", allocates=loop.observer is not None, **kernels)
    after = Answered(span.start, loop.wrench, law.memory, observer.state, loop.delta, loop.commands)
    renewed = True
    while renewed and after.row < span.stop:
        after = run(after, span.stop, law.constants, observer.constants, loop.pivot, recorded)
        law.memory = after.memory
        if renewed := law.outdated(law.memory, law.constants):
            law.renew()
            observer.take_for(law.known)
            after = after._replace(memory=law.memory)
    observer.state, loop.wrench, loop.delta = after.observer, after.wrench, after.delta
    if (k := after.row) < span.stop:
        motion = loop.observer.estimate if loop.observer else as_motion(recorded.motion[k])
        rate = as_acceleration(recorded.acceleration[k])
        age = float(recorded.age[k])
        at = carry(motion, extrapolate(as_motion(recorded.desired[k]), rate, -age), rate, loop.delta, loop.pivot)
        raise cause(law, at, age)


def _serve_interpreted(loop: ControlLoop, recorded: Recorded, span: range, until_law: bool = False) -> range:
    """Answer the rows of a span, or those up to where the law commands by itself; returns the others."""
    for k in span:
        if until_law and loop.follows_law:
            return range(k, span.stop)
        if recorded.due[k]:
            motion, rate, age = as_motion(recorded.motion[k]), as_acceleration(recorded.acceleration[k]), float(recorded.age[k])
            desired = extrapolate(as_motion(recorded.desired[k]), rate, -age)
            loop.step(int(recorded.stamp[k]), motion, desired, rate, int(recorded.measured_at[k]), age)
        recorded.wrench[k] = loop.wrench
    return range(span.stop, span.stop)
