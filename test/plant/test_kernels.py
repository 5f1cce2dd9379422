"""The kernels of the plant, compiled, against the simulator that interprets them."""

import math
from typing import Any

import numpy as np
import pytest
from compiling import fastest, only_compiled
from hulls import COUPLING
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.timing import RateGrid, seconds
from vessel_hsmc_ros.plant.actuators import ActuatorParameters
from vessel_hsmc_ros.plant.disturbance import CurrentParameters, EarthFixedParameters
from vessel_hsmc_ros.plant.dynamics import ShipParameters, acceleration, unforced
from vessel_hsmc_ros.plant.sensors import SensorParameters, sampling
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters, PlantParameters, Simulator, divergence_of_ship
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState, advance, apply, disturbance, is_finite, measure, shown
from vessel_hsmc_ros.plant.waves import WaveParameters

Array = NDArray[np.float64]

GRID = RateGrid(20.0)
STEPS = 60


@kernel
def sail(constants: PlantConstants, state: PlantState, inputs: Any, rows: Array) -> int:
    """The number of steps before the motion diverges; measurement, disturbance, unforced acceleration, state, wrench a row."""
    times, sampled, commands, normal, gusts = inputs
    for k in range(len(times)):
        due = sampled[k]
        state = measure(state, due[0], due[1], due[2], normal[k], times[k], constants)
        load = disturbance(times[k], constants, state)
        rates = unforced(state.motion, constants.vessel, constants.current)
        state = apply(state, (commands[k, 0], commands[k, 1]), constants)
        row, odometry = rows[k], shown(state, constants)
        for i in range(6):
            row[i], row[6 + i] = odometry[i], state.motion[i]
        for i in range(3):
            row[12 + i], row[15 + i] = load[i], rates[i]
        row[18], row[19], row[20] = state.tau
        state = advance(state, state.tau, acceleration(load, constants.vessel), gusts[k], constants)
        if not is_finite(state.motion):
            return k
    return len(times)


def run_compiled(parameters: PlantParameters, commands: Array) -> tuple[int, Array]:
    simulator, stamps = Simulator(parameters, GRID.period), GRID.stamps(len(commands))
    noise = simulator.sensor_noise(len(commands)), simulator.gust_noise(len(commands))
    inputs = (stamps * 1e-9, sampling(parameters.sensors.rates(), stamps), commands, *noise)
    rows = np.zeros((len(commands), 21))
    steps = fastest(sail)(simulator.constants(), simulator.initial_state(), inputs, rows)
    return steps, rows


def run_interpreted(parameters: PlantParameters, commands: Array) -> Array:
    simulator, rows = Simulator(parameters, GRID.period), []
    for k, command in enumerate(commands.tolist()):
        measured, load = simulator.measured(GRID.stamp(k)), simulator.disturbance(seconds(GRID.stamp(k)))
        rates, state = simulator.unforced_acceleration(), simulator.state
        wrench = simulator.applied((command[0], command[1]))
        rows.append([*measured, *state, *load, *rates, *wrench])
        simulator.advance(wrench, load)
    return np.array(rows)


def drawn(seed: int) -> PlantParameters:
    """A plant with all disturbances and errors, of the paper's ship or a coupled one; some are switched off, each in turn."""
    random = np.random.default_rng(seed)

    def number(low: float, high: float) -> float:
        return float(random.uniform(low, high))

    wind = EarthFixedParameters(number(-1e4, 1e4), number(-1e4, 1e4), number(-5, 5), number(0, 3e3), number(1, 30))
    waves = WaveParameters(significant_height=number(0.1, 2), direction=number(-3, 3), components=int(random.integers(1, 40)))
    return PlantParameters(
        vessel=ShipParameters(**COUPLING) if seed % 2 else ShipParameters(),
        initial_pose=(number(-9, 9), number(-9, 9), number(-7, 7)),
        initial_velocity=(number(-2, 2), number(-1, 1), number(-0.2, 0.2)),
        substeps=int(random.integers(1, 4)),
        seed=seed,
        disturbance=DisturbanceParameters(
            earth_fixed=EarthFixedParameters() if seed % 3 == 1 else wind,
            current=CurrentParameters() if seed % 4 == 2 else CurrentParameters(number(-2, 2), number(-2, 2)),
            waves=WaveParameters() if seed % 2 else waves,
        ),
        actuators=ActuatorParameters(
            "wrench",
            *(number(1e4, 1e6), number(1e5, 1e7), number(1e4, 1e6), number(1e5, 1e7), seed % 2, number(0, 2)),
            *((0.0, 0.0) if seed % 4 == 1 else (0.15 * (seed % 3), number(0, 1))),
        ),
        sensors=SensorParameters()
        if seed % 5 == 3
        else SensorParameters(
            position_noise=number(0, 1),
            heading_noise=number(0, 0.1),
            velocity_noise=number(0, 1),
            yaw_rate_noise=number(0, 0.1),
            position_bias=(number(-1, 1), number(-1, 1)),
            position_rate_hz=number(1, 20),
            heading_rate_hz=number(1, 20),
            measures_velocity=bool(seed % 4),
            delay=0.0 if seed % 4 == 3 else 0.1 * (seed % 7),
        ),
    )


def commands(seed: int) -> Array:
    return np.random.default_rng(seed).normal(0.0, (1e5, 1e6), (STEPS, 2))


@pytest.mark.parametrize("seed", range(20))
def test_the_compiled_plant_is_bit_identical_to_the_interpreted_one(seed: int) -> None:
    steps, rows = run_compiled(drawn(seed), commands(seed))
    assert steps == STEPS
    # As integers, so that also the signs of zeros are compared.
    np.testing.assert_array_equal(rows.view(np.int64), run_interpreted(drawn(seed), commands(seed)).view(np.int64))


@only_compiled
def test_a_compiled_motion_that_is_not_finite_is_reported_as_by_the_simulator() -> None:
    plant, wild = PlantParameters(), np.array([(1e5, 0.0)] * 3 + [(1e300, 1e300)] * 2)
    steps, rows = run_compiled(plant, wild)
    error = divergence_of_ship(steps * GRID.period, (rows[steps, 18], rows[steps, 19], rows[steps, 20]), plant.vessel)
    with pytest.raises(SimulationError) as raised:
        run_interpreted(plant, wild)
    assert str(raised.value) == str(error)
    assert steps == 3
    assert math.isfinite(rows[3, 6])
