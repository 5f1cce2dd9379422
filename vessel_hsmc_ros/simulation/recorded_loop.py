"""The controller over recorded inputs: the law and the observer without the plant, compiled where it pays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.kernel_law import KernelLaw
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop
from vessel_hsmc_ros.control.loop.control_period import (
    ControlConstants,
    ControlInputs,
    ControlState,
    cause,
    control_period,
    period_of,
)
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_motion, extrapolate
from vessel_hsmc_ros.simulation.compilation import available, compiled
from vessel_hsmc_ros.simulation.loop import is_compilable

MIN_COMPILED_STEPS = 5000  # fewer steps are interpreted: that takes less time than to load the compiled law


class Recorded(NamedTuple):
    """Recorded inputs of the controller, a row for each odometry message, and the wrenches that it commands."""

    stamp: NDArray[np.int64]  # times of the steps that the messages belong to, (n,) ns
    due: NDArray[np.bool_]  # whether a control period begins, (n,)
    measured_at: NDArray[np.int64]  # times of the measurements, (n,) ns
    age: Array  # how much older than the messages' steps they are, (n,) s
    behind: NDArray[np.int64]  # the same in control periods, rounded, (n,)
    # motion, desired: x, y, psi, u, v, r of ship and reference, (n, 6)
    motion: Array
    desired: Array
    acceleration: Array  # du, dv, dr of the reference, (n, 3)
    wrench: Array  # commanded surge force [N] and yaw moment [N·m], (n, 2), to be written


@kernel
def motion_of(rows: Array, k: int) -> Motion:
    """A row as a motion."""
    return Motion(rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4], rows[k, 5])


@kernel
def inputs_of(recorded: Recorded, k: int) -> ControlInputs:
    """What the control period of row k takes."""
    rate = Acceleration(recorded.acceleration[k, 0], recorded.acceleration[k, 1], recorded.acceleration[k, 2])
    motion, desired = motion_of(recorded.motion, k), motion_of(recorded.desired, k)
    return ControlInputs(recorded.measured_at[k], recorded.age[k], recorded.behind[k], motion, desired, rate)


@kernel
def replay_steps(
    start: int, stop: int, state: ControlState, constants: ControlConstants, recorded: Recorded
) -> tuple[int, ControlState]:
    """Compute the commands for the rows start to stop - 1.

    `start`, `stop`: rows. `state`: what the row before `start` has left; its arrays are written in place.

    Returns:
        The number of rows that are done, and the state that they have left; fewer than `stop` where the law has no finite wrench,
        or needs other constants.
    """
    for k in range(start, stop):
        outdated = False
        if recorded.due[k]:
            period = control_period(inputs_of(recorded, k), state, constants)
            state, outdated = period.state, period.is_outdated
            if not period.is_defined:
                return k, state
        recorded.wrench[k, 0], recorded.wrench[k, 1] = state.wrench
        if outdated:
            return k + 1, state
    return stop, state


def replay_controller(loop: ControlLoop, idle: Observer, recorded: Recorded, span: range, interpreted: bool = False) -> None:
    """Compute the commands for a span of recorded messages, and leave law, observer and wrench of the loop as they are then.

    `idle`: an observer that is switched off, for a loop without one. Raises ControlError if the law is not defined for a
    recorded input.
    """
    law = loop.law
    few = interpreted or len(span) < MIN_COMPILED_STEPS
    if few or not isinstance(law, KernelLaw) or not is_compilable(type(law)) or not available():
        _replay_interpreted(loop, recorded, span)
        return
    # What a person has commanded, and the handover after it, are not compiled.
    span = _replay_interpreted(loop, recorded, span, until_law=True)
    if not span:
        return
    observer = loop.observer or idle
    run = compiled(
        replay_steps,
        f"the law {law.name} for recorded inputs",
        allocates=loop.observer is not None,
        control_period=period_of(type(law), loop.observer is not None),
    )
    row, state = span.start, ControlState(loop.wrench, law.memory, observer.state, loop.delta, loop.commands)
    constants = ControlConstants(law.constants, observer.constants, loop.point, law.vessel.steering)
    renewed = True
    while renewed and row < span.stop:
        row, state = run(row, span.stop, state, constants, recorded)
        law.memory = state.memory
        if renewed := law.outdated(law.memory, law.constants):
            law.renew()
            observer.take_for(law.known)
            state = state._replace(memory=law.memory)
            constants = constants._replace(law=law.constants, observer=observer.constants)
    observer.state, loop.wrench, loop.delta = state.observer, state.wrench, state.delta
    if row < span.stop:
        raise cause(law, inputs_of(recorded, row), state, constants)


def _replay_interpreted(loop: ControlLoop, recorded: Recorded, span: range, until_law: bool = False) -> range:
    """Compute the commands for the rows of a span, or those up to where the law commands by itself; returns the others."""
    for k in span:
        if until_law and loop.follows_law:
            return range(k, span.stop)
        if recorded.due[k]:
            motion, rate, age = as_motion(recorded.motion[k]), as_acceleration(recorded.acceleration[k]), float(recorded.age[k])
            desired = extrapolate(as_motion(recorded.desired[k]), rate, -age)
            loop.step(int(recorded.stamp[k]), motion, desired, rate, int(recorded.measured_at[k]), age)
        recorded.wrench[k] = loop.wrench
    return range(span.stop, span.stop)
