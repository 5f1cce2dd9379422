"""The closed loop as one kernel: plant, reference, observer and law, step by step as in the nodes."""

from typing import Any

from vessel_hsmc_ros.control.control_period import ControlInputs, Period, control_period
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, published
from vessel_hsmc_ros.plant.dynamics import Wrench, acceleration, unforced
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState, apply, disturbance, is_finite, measure, shown
from vessel_hsmc_ros.plant.step import advance as advance_plant
from vessel_hsmc_ros.simulation.loop_state import Constants, Inputs, Kept, State

DONE, UNDEFINED, DIVERGED, OUTDATED = 0, 1, 2, 3
"""Why the loop has stopped: at the requested step, before a step at which the law has no finite wrench, after a step that ended
with a motion that is not finite, or after one after which the law needs other constants."""


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
def control_inputs(k: int, measured: Motion, desired: Motion, inputs: Inputs) -> ControlInputs:
    """What the control period of step k takes.

    Args:
        k: Index of the step.
        measured, desired: States of ship and reference as their messages give them.
        inputs: What is known of every step.
    """
    row = inputs.reference[inputs.latest[k]]
    rate = Acceleration(row[6], row[7], row[8])
    return ControlInputs(inputs.measured_at[k], inputs.age[k], inputs.behind[k], measured, desired, rate)


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
    periods, plant, controller = state
    c, last = constants.plant, len(inputs.time) - 1
    for k in range(start, stop):
        time = inputs.time[k]
        disturbing = disturbance(time, c, plant)
        sampled = inputs.sampled[k]
        plant = measure(plant, sampled[0], sampled[1], sampled[2], inputs.sensor_noise[k], time, c)
        shown, measured = received(plant, c)
        desired = desired_motion(inputs.reference, inputs.latest[k])
        renewed = False
        if inputs.due[k]:
            period = control_period(control_inputs(k, measured, desired, inputs), controller, constants.controller)
            controller, renewed = period.state, period.is_outdated
            if not period.is_defined:
                return UNDEFINED, k, State(periods, plant, controller)
            keep_period(periods, period, kept)
            periods += 1
        plant = drive(inputs.stamp[k], plant, controller.wrench, measured.u, c, constants.drive)
        if len(kept.rows):
            keep(kept.rows[k], time, (shown, measured, desired), controller.wrench, disturbing, plant, c)
        else:
            keep_brief(kept.brief, k, shown, desired, plant.tau, controller.wrench)
        reason = OUTDATED if renewed else DONE
        if k < last:  # the last sample is the final state
            plant = advance_plant(plant, plant.tau, acceleration(disturbing, c.vessel), inputs.gust_noise[k], c)
            reason = reason if is_finite(plant.motion) else DIVERGED
        if reason != DONE:
            return reason, k + 1, State(periods, plant, controller)
    return DONE, stop, State(periods, plant, controller)


@kernel
def keep_period(k: int, period: Period, kept: Kept) -> None:
    """Write what the controller has computed in a control period.

    Args:
        k: Its index.
        period: Its result; the memory of the law has the weights that it has used.
        kept: Arrays to write.
    """
    if k < len(kept.terms):
        write(kept.terms[k], 0, period.terms)
        W = period.state.memory.W
        for i in range(len(W)):
            for j in range(W.shape[1]):
                kept.weights[k, i, j] = W[i, j]
    if k < len(kept.estimates):
        write(kept.estimates[k], 0, period.motion)
        kept.estimates[k, 6] = published(period.motion).psi
    if k < len(kept.back):
        write(kept.back[k], 0, period.back)
