"""One period of the plant as kernels: disturbance, measurement, actuators and motion, with the random numbers passed in."""

import math
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.delay_line import DelayLine, delayed, fill, put
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion, to_body
from vessel_hsmc_ros.core.steering import Steering, available
from vessel_hsmc_ros.plant.actuators import Actuator, actuate, arrived
from vessel_hsmc_ros.plant.disturbance import Gust, Periodic, Wind, next_gust, periodic_wrench, total, wind_wrench
from vessel_hsmc_ros.plant.dynamics import Vessel, Wrench, rk4_step
from vessel_hsmc_ros.plant.sensors import Sensors, measurement
from vessel_hsmc_ros.plant.waves import Sea, drift_force, with_waves


class PlantConstants(NamedTuple):
    """What stays constant as long as no parameter changes."""

    vessel: Vessel  # coefficients of the ship
    current: tuple[float, float]  # east and north, m/s
    # periodic, wind, sea: the disturbances
    periodic: Periodic
    wind: Wind
    sea: Sea
    # surge, yaw: the actuators
    surge: Actuator
    yaw: Actuator
    steering: Steering  # how the yaw moment depends on thrust and speed
    sensors: Sensors  # bias and noise
    odometry_is_true: bool  # whether measurements equal the state: perfect sensors and no waves
    # step, substeps: length of an integration step, s, and number of them in a period
    step: float
    substeps: int


class PlantState(NamedTuple):
    """What a period leaves to the next."""

    motion: Motion  # true motion, without the wave-frequency motion
    measured: Motion  # the latest sample of each sensor
    tau: Wrench  # the applied wrench: surge force [N], sway force [N], yaw moment [N·m]
    gust: Gust  # g_E, g_N, N
    commands: DelayLine  # commands of the last periods, for the dead time of the actuators; written in place
    sent: DelayLine  # measurements of the last periods, for the delay of the odometry; written in place


@kernel
def disturbance(time: float, constants: PlantConstants, state: PlantState) -> Wrench:
    """The sum of all disturbing wrenches, N, N, N·m."""
    wrench = periodic_wrench(time, constants.periodic)
    if constants.wind.blows:
        wrench = total(wrench, wind_wrench(state.gust, state.motion.psi, constants.wind))
    if constants.sea.rough:
        wrench = total(wrench, drift_force(time, state.motion, constants.current, constants.sea))
    return wrench


@kernel
def measure(
    state: PlantState,
    sampled_position: bool,
    sampled_heading: bool,
    sampled_velocity: bool,
    normal: Any,
    time: float,
    constants: PlantConstants,
) -> PlantState:
    """The state with the measurement of this period, which includes the wave-frequency motion.

    `sampled_position`, `sampled_heading`, `sampled_velocity`: whether each of the sensors samples now. `normal`: independent
    standard normal numbers, shape (6,); not used where the odometry is true. `time`: time since the start, s.
    """
    motion = state.motion
    if constants.odometry_is_true:
        return PlantState(motion, motion, state.tau, state.gust, state.commands, state.sent)
    # Superposition: the wave-frequency motion is added to the measurement only; the manoeuvring state stays without it.
    if constants.sea.rough:
        motion = with_waves(time, motion, constants.current, constants.sea)
    sampled = sampled_position, sampled_heading, sampled_velocity
    measured = measurement(motion, state.measured, sampled, normal, constants.sensors)
    if constants.sensors.late > 0:
        if state.sent.last[0] < 0:
            fill(state.sent, measured)
        else:
            put(state.sent, measured)
    return PlantState(state.motion, measured, state.tau, state.gust, state.commands, state.sent)


@kernel
def shown(state: PlantState, constants: PlantConstants) -> Motion:
    """What odometry shows in this period, after `measure`: the measurement, after its delay; at the start, the first one."""
    late, sent = constants.sensors.late, state.sent
    if late == 0:
        return state.measured
    x, y, psi = delayed(sent, late, 0), delayed(sent, late, 1), delayed(sent, late, 2)
    return Motion(x, y, psi, delayed(sent, late, 3), delayed(sent, late, 4), delayed(sent, late, 5))


@kernel
def apply(state: PlantState, command: tuple[float, float], constants: PlantConstants) -> PlantState:
    """The state with the wrench tau that the actuators apply in this period.

    `state`: state with the wrench of the last period. `command`: commanded surge force [N] and yaw moment [N·m], finite.
    """
    force, moment = arrived(command, state.commands, constants.surge, constants.yaw)
    # No actuator acts on the sway: the ship is underactuated.
    surge, yaw = actuate(state.tau[0], force, constants.surge), actuate(state.tau[2], moment, constants.yaw)
    if constants.steering.loss > 0.0:
        motion, current = state.motion, constants.current
        yaw = available(surge, yaw, motion.u - to_body(current[0], current[1], motion.psi)[0], constants.steering)
    tau = surge, 0.0, yaw
    return PlantState(state.motion, state.measured, tau, state.gust, state.commands, state.sent)


@kernel
def advance(state: PlantState, tau: Wrench, disturbing: Wrench, gust_noise: Any, constants: PlantConstants) -> PlantState:
    """The state one period later; where the motion diverges, it is not finite (`is_finite`).

    `state`: state at the start of the period. `tau`: applied wrench, N, N, N·m; with the disturbance constant over the period,
    also over its substeps. `disturbing`: disturbing accelerations, m/s², m/s², rad/s². `gust_noise`: independent standard
    normal numbers, shape (2,); not used where no wind blows.
    """
    motion, gust = state.motion, state.gust
    for _ in range(constants.substeps):
        motion = rk4_step(motion, tau, disturbing, constants.vessel, constants.step, constants.current)
    if constants.wind.blows:
        gust = next_gust(gust, gust_noise, constants.wind)
    return PlantState(motion, state.measured, state.tau, gust, state.commands, state.sent)


@kernel
def is_finite(motion: Motion) -> bool:
    """Whether no component is infinite or NaN."""
    pose = math.isfinite(motion.x) and math.isfinite(motion.y) and math.isfinite(motion.psi)
    return pose and math.isfinite(motion.u) and math.isfinite(motion.v) and math.isfinite(motion.r)
