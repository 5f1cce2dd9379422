"""The closed loop as one kernel: plant, reference, observer and law, step by step as in the nodes."""

import math
from typing import Any

from vessel_hsmc_ros.control.observer_filter import ObserverConstants, ObserverState, estimate, observe
from vessel_hsmc_ros.control.pivot import Carried, carry
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.delay_line import delayed, put
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate, published
from vessel_hsmc_ros.plant.dynamics import Wrench, acceleration, unforced
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState, apply, disturbance, is_finite, measure, shown
from vessel_hsmc_ros.plant.step import advance as advance_plant
from vessel_hsmc_ros.simulation.loop_state import Constants, Inputs, Kept, State

DONE, UNDEFINED, DIVERGED, OUTDATED = 0, 1, 2, 3
"""Why the loop has stopped: at the requested step, before a step at which the law has no finite wrench, after a step that ended
with a motion that is not finite, or after one after which the law needs other constants."""


@kernel
def law_step(
    at: Carried,
    age: float,
    memory: Any,
    constants: Any,  # noqa: ARG001 - a stand-in
) -> tuple[tuple[float, float], Any, Any]:
    """Stands for `law_call.law_call` of a law, which takes this place where the loop is compiled."""
    return (math.nan, math.nan), (at.motion.x, at.desired.x, age), memory


@kernel
def law_outdated(memory: Any, constants: Any) -> bool:  # noqa: ARG001 - a stand-in
    """Stands for `KernelLaw.outdated` of a law."""
    return False


@kernel
def unobserved(
    stamp: int,  # noqa: ARG001 - in the place of `observe`
    pose: Any,  # noqa: ARG001
    wrench: Any,  # noqa: ARG001
    state: ObserverState,
    constants: ObserverConstants,  # noqa: ARG001
) -> ObserverState:
    """Takes the place of `observe` where the observer is switched off, which halves the time of compilation."""
    return state


@kernel
def drive(
    stamp: int,  # noqa: ARG001 - in the place of `drive_by_thrusters`
    plant: PlantState,
    wrench: tuple[float, float],
    surge_speed: float,  # noqa: ARG001
    c: PlantConstants,
    state: Any,  # noqa: ARG001
) -> PlantState:
    """Apply the command by the actuators of a wrench; where thrusters drive the ship, `drive_by_thrusters` takes this place."""
    return apply(plant, wrench, c)


@kernel
def write(row: Array, start: int, values: Any) -> None:
    """Write the elements of a tuple into a row."""
    for i in range(len(values)):
        row[start + i] = values[i]


@kernel
def desired_motion(reference: Array, i: int) -> Motion:
    """A motion of the reference as the controller receives it."""
    return Motion(reference[i, 0], reference[i, 1], reference[i, 9], reference[i, 3], reference[i, 4], reference[i, 5])


@kernel
def received(plant: PlantState, constants: PlantConstants) -> tuple[Motion, Motion]:
    """State and measurement as their messages give them."""
    state = published(plant.motion)
    return state, (state if constants.odometry_is_true else published(shown(plant, constants)))


@kernel
def keep(
    row: Array, time: float, received: tuple[Motion, Motion, Motion], wrench: Any, disturbing: Any, state: Any, c: Any
) -> None:
    """Write a row.

    Args:
        row: The row, shape (35,).
        time: Time, s.
        received: State, measurement and reference as their messages give them.
        wrench: Commanded surge force [N] and yaw moment [N·m].
        disturbing: Disturbing wrench, N, N, N·m.
        state: State of the plant, with the wrench that its actuators apply.
        c: Constants of the plant.
    """
    row[0] = time
    for i in range(3):
        write(row, 1 + 6 * i, received[i])
    row[19], row[20] = state.tau[0], state.tau[2]
    write(row, 21, wrench)
    write(row, 23, acceleration(disturbing, c.vessel))
    write(row, 26, unforced(state.motion, c.vessel, c.current))
    row[29], row[30] = state.motion.psi, shown(state, c).psi
    write(row, 31, disturbing)
    row[34] = state.tau[1]


@kernel
def keep_brief(brief: Array, k: int, state: Motion, desired: Motion, tau: Wrench, wrench: tuple[float, float]) -> None:
    """Write a column of what metrics need.

    Args:
        brief: The array, (7, n).
        k: Index of the step.
        state, desired: State and reference as their messages give them.
        tau: Applied wrench, N, N, N·m.
        wrench: Commanded surge force [N] and yaw moment [N·m].
    """
    brief[0, k], brief[1, k], brief[2, k] = state.x - desired.x, state.y - desired.y, state.psi - desired.psi
    brief[3, k], brief[4, k] = tau[0], tau[2]
    brief[5, k], brief[6, k] = wrench


@kernel
def advance(start: int, stop: int, state: State, constants: Constants, inputs: Inputs, kept: Kept) -> tuple[int, int, State]:
    """Steps start to stop - 1 of the loop.

    Args:
        start, stop: Indices of steps.
        state: What the step before `start` has left; its arrays are written in place.
        constants: What stays constant.
        inputs: What is known of every step.
        kept: Arrays to write.

    Returns:
        Why the loop has stopped, the number of rows that are done, and the state that they have left.
    """
    periods, wrench, memory, observed, plant, delta, commands = state
    c, last = constants.plant, len(inputs.time) - 1
    for k in range(start, stop):
        time = inputs.time[k]
        disturbing = disturbance(time, c, plant)
        sampled = inputs.sampled[k]
        plant = measure(plant, sampled[0], sampled[1], sampled[2], inputs.sensor_noise[k], time, c)
        shown, measured = received(plant, c)
        i = inputs.latest[k]
        desired = desired_motion(inputs.reference, i)
        sensed, renewed = measured, False
        if inputs.due[k]:
            if constants.observer.enabled:
                pose = (measured.x, measured.y, measured.psi)
                q = inputs.behind[k]
                then = delayed(commands, q, 0), delayed(commands, q, 1)
                observed = observe(inputs.measured_at[k], pose, then, observed, constants.observer)
                measured = estimate(observed)
            rate = Acceleration(inputs.reference[i, 6], inputs.reference[i, 7], inputs.reference[i, 8])
            age = inputs.age[k]
            at = carry(measured, extrapolate(desired, rate, -age), rate, delta, constants.pivot)
            demand, terms, memory = law_step(at, age, memory, constants.law)
            if not (math.isfinite(demand[0]) and math.isfinite(demand[1])):
                return UNDEFINED, k, State(periods, wrench, memory, observed, plant, delta, commands)
            wrench, delta = demand, at.delta
            renewed = law_outdated(memory, constants.law)
            if constants.observer.enabled:
                put(commands, wrench)
            keep_period(periods, terms, memory, measured, kept)
            if periods < len(kept.back):
                write(kept.back[periods], 0, at.back)
            periods += 1
        plant = drive(inputs.stamp[k], plant, wrench, sensed.u, c, constants.drive)
        if len(kept.rows):
            keep(kept.rows[k], time, (shown, sensed, desired), wrench, disturbing, plant, c)
        else:
            keep_brief(kept.brief, k, shown, desired, plant.tau, wrench)
        reason = OUTDATED if renewed else DONE
        if k < last:  # the last sample is the final state
            plant = advance_plant(plant, plant.tau, acceleration(disturbing, c.vessel), inputs.gust_noise[k], c)
            reason = reason if is_finite(plant.motion) else DIVERGED
        if reason != DONE:
            return reason, k + 1, State(periods, wrench, memory, observed, plant, delta, commands)
    return DONE, stop, State(periods, wrench, memory, observed, plant, delta, commands)


@kernel
def keep_period(period: int, terms: Any, memory: Any, estimated: Motion, kept: Kept) -> None:
    """Write what the controller has computed in a control period.

    Args:
        period: Its index.
        terms: Terms of the law.
        memory: Internal state of the law, with the weights that it has used.
        estimated: The motion that the law has received.
        kept: Arrays to write.
    """
    if period < len(kept.terms):
        write(kept.terms[period], 0, terms)
        for i in range(len(memory.W)):
            for j in range(memory.W.shape[1]):
                kept.weights[period, i, j] = memory.W[i, j]
    if period < len(kept.estimates):
        write(kept.estimates[period], 0, estimated)
        kept.estimates[period, 6] = published(estimated).psi
