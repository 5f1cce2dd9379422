"""Discrete-time simulation of the plant, shared by the simulator node and the offline loop."""

import math
from dataclasses import dataclass, replace

import numpy as np

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.timing import seconds
from vessel_sim_node.actuators import ActuatorParameters, Actuators
from vessel_sim_node.disturbance import (
    CurrentParameters,
    EarthFixedParameters,
    PeriodicParameters,
    Wind,
    Wrench,
    acceleration,
    periodic_wrench,
    total,
)
from vessel_sim_node.integrate import rk4
from vessel_sim_node.plant import Array, ShipParameters, divergence, initial_pose, initial_velocity, unforced_in_current
from vessel_sim_node.sensors import SensorParameters, Sensors
from vessel_sim_node.waves import WaveParameters, Waves


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


class Simulator:
    """The plant in discrete time, with inputs and disturbances constant over a period.

    Args:
        parameters: Parameters of the plant.
        period: Time between two odometry messages, s.

    Attributes:
        state: True x, y, psi, u, v, r, without the wave-frequency motion, shape (6,).
        odometry_is_true: Whether measurements equal the state: perfect sensors and no waves.
    """

    def __init__(self, parameters: PlantParameters, period: float) -> None:
        self._parameters = parameters
        self._period = period
        self._phase = 0.0
        self._periods = 0
        self._vessel = parameters.vessel.coefficients()
        self._current = parameters.disturbance.current.east, parameters.disturbance.current.north
        self.odometry_is_true = parameters.sensors.perfect() and not parameters.disturbance.waves.significant_height
        self.reset()

    def reset(self) -> None:
        """Return to the initial state and restart the random numbers from their seed."""
        p, environment = self._parameters, self._parameters.disturbance
        # Separate generators: switching one source of randomness on or off leaves the others unchanged.
        gusts, sensors, sea = (np.random.default_rng((p.seed, i)) for i in range(3))
        self.state: Array = np.array(p.initial_pose + p.initial_velocity)
        self._actuators = Actuators(within(p.actuators, p.vessel), self._period)
        self._sensors = Sensors(p.sensors, sensors)
        self._gusts = gusts
        self._wind = Wind(environment.earth_fixed, self._period, gusts) if environment.earth_fixed.active() else None
        self._waves = Waves(environment.waves, sea, p.vessel) if environment.waves.significant_height else None

    def retune(self, changed: DisturbanceParameters, time: float) -> None:
        """Take changed periodic and earth-fixed disturbances and a changed current while the ship moves.

        No phase jumps: w·t + phase of the periodic disturbance and the phases of the waves, which ride on the current, are
        continuous at the time of the change; the gusts go on from their present values.

        Args:
            changed: All disturbances; the waves are those of the start.
            time: Time since the start, s.
        """
        old = self._parameters.disturbance
        self._parameters = replace(self._parameters, disturbance=changed)
        # w·t + phase stays equal at the time of the change.
        self._phase += (old.periodic.frequency - changed.periodic.frequency) * time
        current = changed.current.east, changed.current.north
        if self._waves:
            self._waves.change_current(self._current, current, time)
        self._current = current
        if self._wind:
            self._wind.retune(changed.earth_fixed)
        elif changed.earth_fixed.active():
            self._wind = Wind(changed.earth_fixed, self._period, self._gusts)

    def measured(self, stamp: int) -> Array:
        """The measurement of this step, shape (6,); call it once per step, because it draws noise.

        It includes the wave-frequency motion, which the state does not.

        Args:
            stamp: Time since the start, ns.
        """
        if self.odometry_is_true:
            return self.state
        # Superposition: the wave-frequency motion is added to the measurement only; the manoeuvring state stays without it.
        moved = self._waves.moved(seconds(stamp), self.state, self._current) if self._waves else self.state
        return self._sensors.measure(stamp, moved)

    def disturbance(self, time: float) -> Wrench:
        """The sum of all disturbing wrenches, N, N, N·m.

        Args:
            time: Time since the start, s.
        """
        wrench = periodic_wrench(time, self._parameters.disturbance.periodic, self._phase)
        if self._wind:
            wrench = total(wrench, self._wind.wrench(float(self.state[2])))
        if self._waves:
            wrench = total(wrench, self._waves.drift(time, self.state, self._current))
        return wrench

    def unforced_acceleration(self) -> tuple[float, float, float]:
        """The present f_u, f_v, f_r of (7), in a current with its additional terms: m/s², m/s², rad/s²."""
        return unforced_in_current(self.state, self._vessel, self._current)

    def applied(self, command: tuple[float, float]) -> tuple[float, float]:
        """The wrench after the actuators, N, N·m; call it once per step, because it advances the actuators.

        Args:
            command: Commanded surge force [N] and yaw moment [N·m].

        Raises:
            SimulationError: the command is not finite.
        """
        check_command(command)
        return self._actuators.step(command)

    def advance(self, wrench: tuple[float, float], disturbance: Wrench) -> None:
        """Advance the plant by one period.

        Args:
            wrench: Applied surge force [N] and yaw moment [N·m].
            disturbance: Disturbing wrench, N, N, N·m.

        Raises:
            SimulationError: the motion is no longer finite.
        """
        step = self._period / self._parameters.substeps
        # Zero-order hold: wrench and disturbance are constant over the period, also over its substeps.
        disturbing = acceleration(disturbance, self._vessel)
        state = self.state
        # A diverging motion is reported once below; NumPy's warnings about it would be noise.
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                for _ in range(self._parameters.substeps):
                    state = rk4(state, wrench, disturbing, self._vessel, step, self._current)
            except ValueError:  # the cosine of an infinite heading
                state = np.full(6, np.nan)
        if not np.isfinite(state).all():
            cause = f"under {wrench[0]:g} N and {wrench[1]:g} N·m: the closed loop is unstable or the step too long"
            raise divergence("ship", self._periods * self._period, cause, self._parameters.vessel)
        self.state = state
        self._periods += 1
        if self._wind:
            self._wind.advance()


def within(actuators: ActuatorParameters, vessel: ShipParameters) -> ActuatorParameters:
    """The actuators within the limits of the propulsion: of both limits the tighter one holds."""
    return replace(
        actuators,
        surge_force_limit=min(actuators.surge_force_limit, vessel.surge_force_limit),
        yaw_moment_limit=min(actuators.yaw_moment_limit, vessel.yaw_moment_limit),
    )


def check_command(command: tuple[float, float]) -> None:
    """Reject a command that is not finite: one NaN would remain in the state for ever.

    Args:
        command: Commanded surge force [N] and yaw moment [N·m].

    Raises:
        SimulationError: the surge force or the yaw moment is not finite.
    """
    if not (math.isfinite(command[0]) and math.isfinite(command[1])):
        raise SimulationError(f"commanded wrench ({command[0]} N, {command[1]} N·m) is not allowed: both must be finite numbers")
