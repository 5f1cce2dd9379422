"""Parameters and discrete-time simulation of the plant, shared by the simulator node and the offline loop.

One period of the plant as kernels: disturbance, measurement, actuators and motion, with the random numbers passed in.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError, SimulationError
from vessel_hsmc_ros.core.hull import Steering, available, steering
from vessel_hsmc_ros.core.kernel import Array, DelayLine, delay_line, delayed, fill, kernel, put
from vessel_hsmc_ros.core.kinematics import Motion, as_motion, to_body
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.plant.devices import (
    Actuator,
    ActuatorParameters,
    Sampling,
    SensorParameters,
    Sensors,
    actuate,
    arrived,
    measurement,
)
from vessel_hsmc_ros.plant.disturbance import (
    CurrentParameters,
    EarthFixedParameters,
    Gust,
    Periodic,
    PeriodicParameters,
    Sea,
    WaveParameters,
    Wind,
    drift_force,
    make_sea,
    next_gust,
    periodic_wrench,
    total,
    wind_wrench,
    with_waves,
)
from vessel_hsmc_ros.plant.dynamics import Vessel, Wrench, acceleration, rk4_step, unforced
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters, check_hull, divergence, initial_pose, initial_velocity, outside


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


@dataclass(frozen=True)
class DisturbanceParameters:
    """The disturbances of the plant; their wrenches add up."""

    periodic: PeriodicParameters = group(PeriodicParameters, tunable=True)
    earth_fixed: EarthFixedParameters = group(EarthFixedParameters, tunable=True)
    current: CurrentParameters = group(CurrentParameters, tunable=True)
    waves: WaveParameters = group(WaveParameters)


@dataclass(frozen=True)
class PlantParameters:
    """The plant: initial state, coefficients, disturbances, actuators and sensors."""

    initial_pose: tuple[float, ...] = initial_pose((5.0, 1.0, math.pi / 4))
    initial_velocity: tuple[float, ...] = initial_velocity()
    substeps: int = parameter(1, "Integration steps between two odometry messages.", low=1, high=1000)
    seed: int = parameter(0, "Seed of all random numbers; runs with the same seed are bit-identical.", low=0, high=2**31 - 1)
    vessel: ShipParameters = group(ShipParameters)
    disturbance: DisturbanceParameters = group(DisturbanceParameters)
    actuators: ActuatorParameters = group(ActuatorParameters)
    sensors: SensorParameters = group(SensorParameters)

    def __post_init__(self) -> None:
        if self.by_thrusters and not self.vessel.thrusters:
            raise ParameterError("vessel_sim.actuators.kind = thrusters needs vessel.thrusters.names")

    @property
    def by_thrusters(self) -> bool:
        """Whether thrusters drive the ship, not a wrench."""
        return self.actuators.kind == "thrusters"


AT_REST = as_motion((0.0,) * 6)
CALM = (0.0, 0.0)
NO_WRENCH = (0.0, 0.0, 0.0)


class Simulator:
    """The plant in discrete time, with inputs and disturbances constant over a period.

    `period`: time between two odometry messages, s.

    Raises:
        ParameterError: damping adds energy to the ship.

    Attributes:
        odometry_is_true: Whether measurements equal the state: perfect sensors and no waves.
    """

    def __init__(self, parameters: PlantParameters, period: float) -> None:
        check_hull(parameters.vessel)
        self._parameters = parameters
        self._period = period
        self._phase = 0.0
        self._periods = 0
        self.reset()
        self.odometry_is_true = self._constants.odometry_is_true

    def reset(self) -> None:
        """Return to the initial state and restart the random numbers from their seed."""
        p, wind = self._parameters, self._parameters.disturbance.earth_fixed
        # Separate generators: switching one source of randomness on or off leaves the others unchanged.
        self._gusts, self._noise, sea = (np.random.default_rng((p.seed, i)) for i in range(3))
        self._sampling = Sampling(p.sensors.rates())
        self._constants = plant_constants(p, self._period, make_sea(p.disturbance.waves, sea, p.vessel), self._phase)
        gust = self._first_gust() if wind.active() else CALM
        c = self._constants
        lines = delay_line(max(c.surge.late, c.yaw.late), 2), delay_line(c.sensors.late, 6)
        self._state = PlantState(as_motion(p.initial_pose + p.initial_velocity), AT_REST, NO_WRENCH, gust, *lines)
        self._measurements = 0

    @property
    def state(self) -> Motion:
        """True x, y, psi, u, v, r, without the wave-frequency motion."""
        return self._state.motion

    def constants(self) -> PlantConstants:
        """What the compiled kernels of a period need, with arrays."""
        return self._constants._replace(sea=self._constants.sea.as_arrays())

    def initial_state(self) -> PlantState:
        """The state of the first period; it is that of the present one."""
        return self._state

    def gust_noise(self, count: int) -> Array:
        """Draw the standard normal numbers of the gusts for the next periods, (count, 2)."""
        return self._gusts.standard_normal((count, 2))

    def sensor_noise(self, count: int) -> Array:
        """Draw the standard normal numbers of the sensors for the next measurements, (count, 6)."""
        return self._noise.standard_normal((count, 6))

    def retune(self, changed: DisturbanceParameters, time: float) -> None:
        """Take changed periodic and earth-fixed disturbances and a changed current while the ship moves.

        No phase jumps: w·t + phase of the periodic disturbance and the phases of the waves, which ride on the current, are
        continuous at the time of the change; the gusts go on from their present values. `changed`: all disturbances; the waves
        are those of the start. `time`: time since the start, s.
        """
        old, constants = self._parameters.disturbance, self._constants
        self._parameters = replace(self._parameters, disturbance=changed)
        # w·t + phase stays equal at the time of the change.
        self._phase += (old.periodic.frequency - changed.periodic.frequency) * time
        change = changed.current.east - old.current.east, changed.current.north - old.current.north
        sea = constants.sea.with_current(change, time)
        self._constants = plant_constants(self._parameters, self._period, sea, self._phase, constants.wind.blows)
        if self._constants.wind.blows and not constants.wind.blows:
            self._state = self._state._replace(gust=self._first_gust())

    def _first_gust(self) -> Gust:
        """A gust from the stationary distribution, so that there is no transient of the gusts."""
        east, north = (self._parameters.disturbance.earth_fixed.gust_deviation * self._gusts.standard_normal(2)).tolist()
        return east, north

    def measured(self, stamp: int) -> Motion:
        """What odometry shows in this step; call it once per step, because it draws noise.

        It is the measurement of `periods_late` periods ago, and includes the wave-frequency motion, which the state does not.
        `stamp`: time since the start, ns.
        """
        if self.odometry_is_true:
            return self._state.motion
        # Noise is drawn at every call, also for held samples: so the random sequence does not depend on the sampling rates.
        normal = self._noise.standard_normal(6).tolist()
        self._state = measure(self._state, *self._sampling.due(stamp), normal, seconds(stamp), self._constants)
        self._measurements += 1
        return shown(self._state, self._constants)

    @property
    def periods_late(self) -> int:
        """The age of the latest `measured` in periods: the delay of the sensors, or less right after the start."""
        return min(self._constants.sensors.late, max(self._measurements - 1, 0))

    def disturbance(self, time: float) -> Wrench:
        """The sum of all disturbing wrenches, N, N, N·m."""
        return disturbance(time, self._constants, self._state)

    def unforced_acceleration(self) -> tuple[float, float, float]:
        """The present f_u, f_v, f_r of (7), in a current with its additional terms: m/s², m/s², rad/s²."""
        return unforced(self._state.motion, self._constants.vessel, self._constants.current)

    def outside_hull_data(self) -> str:
        """The present velocity through the water that lies outside of its declared range, in words; empty if there is none."""
        m, current = self._state.motion, self._constants.current
        c, s = math.cos(m.psi), math.sin(m.psi)
        through_water = m.u - current[0] * c - current[1] * s, m.v - current[1] * c + current[0] * s, m.r
        return outside(self._parameters.vessel, through_water)

    def applied(self, command: tuple[float, float]) -> Wrench:
        """The wrench after the actuators, N, N, N·m; call it once per step, because it advances the actuators.

        `command`: commanded surge force [N] and yaw moment [N·m]. Raises SimulationError if the command is not finite.
        """
        if not (math.isfinite(command[0]) and math.isfinite(command[1])):  # a NaN would remain in the state indefinitely
            raise SimulationError(f"commanded wrench must be finite numbers (got {command[0]} N, {command[1]} N·m)")
        self._state = apply(self._state, command, self._constants)
        return self._state.tau

    def advance(self, wrench: Wrench, disturbance: Wrench) -> None:
        """Advance the plant by one period. `wrench`: applied wrench, N, N, N·m. `disturbance`: disturbing wrench, N, N, N·m."""
        c = self._constants
        noise = self._gusts.standard_normal(2).tolist() if c.wind.blows else CALM
        try:
            state = advance(self._state, wrench, acceleration(disturbance, c.vessel), noise, c)
        except ValueError:  # the cosine of an infinite heading
            state = None
        if state is None or not is_finite(state.motion):
            raise divergence_of_ship(self._periods * self._period, wrench, self._parameters.vessel)
        self._state = state
        self._periods += 1


def plant_constants(p: PlantParameters, period: float, sea: Sea, phase: float = 0.0, blowing: bool = False) -> PlantConstants:
    """The constants of the plant in discrete time.

    `period`: time between two odometry messages, s. `phase`: phase of the periodic disturbance. `blowing`: whether the wind has
    blown before.
    """
    environment, limits = p.disturbance, within(p.actuators, p.vessel)
    return PlantConstants(
        p.vessel.coefficients(),
        (environment.current.east, environment.current.north),
        environment.periodic.constants(phase),
        environment.earth_fixed.constants(period, blowing),
        sea,
        *limits.constants(period),
        steering(p.vessel.steering_loss, p.vessel.steering_speed, limits.surge_force_limit, limits.yaw_moment_limit),
        p.sensors.constants(period),
        p.sensors.perfect() and not sea.rough,
        period / p.substeps,
        p.substeps,
    )


def divergence_of_ship(time: float, wrench: Wrench, vessel: ShipParameters) -> SimulationError:
    """The error for a motion of the ship that is no longer finite.

    `time`: start of the period that ended so, s. `wrench`: applied wrench, N, N, N·m.
    """
    cause = f"under {wrench[0]:g} N and {wrench[2]:g} N·m: the closed loop is unstable or the step too long"
    return divergence("ship", time, cause, vessel)


def within(actuators: ActuatorParameters, vessel: ShipParameters) -> ActuatorParameters:
    """The actuators within the limits of the propulsion: of both limits the tighter one holds."""
    return replace(
        actuators,
        surge_force_limit=min(actuators.surge_force_limit, vessel.surge_force_limit),
        yaw_moment_limit=min(actuators.yaw_moment_limit, vessel.yaw_moment_limit),
    )
