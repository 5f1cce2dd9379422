"""The kernels of the plant, compiled, against the simulator that interprets them."""

from dataclasses import fields, replace

import numpy as np
import pytest
from durations import rest_long
from hulls import COUPLING
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.plant.devices import ActuatorParameters, SensorParameters
from vessel_hsmc_ros.plant.disturbance import CurrentParameters, EarthFixedParameters, WaveParameters
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters, PlantParameters
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compilation import available
from vessel_hsmc_ros.simulation.compiled_loop import CompiledLoop, make_loop

Array = NDArray[np.float64]

RATE_HZ = 20.0
STEPS = 60


def scenario_of(plant: PlantParameters, commands: Array) -> Scenario:
    """A plant under these commands, by the law that reads them from a list, whose loop is compiled for other tests too."""
    times = tuple((np.arange(len(commands)) / RATE_HZ).tolist())
    surge, yaw = (tuple(column) for column in commands.T.tolist())
    scenario = load_scenario(
        "case2_tracking",
        {
            **{f"{node}.rate_hz": RATE_HZ for node in ("vessel_sim", "reference_ship", "controller")},
            "vessel_sim.duration": (len(commands) - 1) / RATE_HZ,
            "controller.law": "open_loop",
            "controller.open_loop.times": times,
            "controller.open_loop.surge_force": surge,
            "controller.open_loop.yaw_moment": yaw,
        },
    )
    drawn_values = {each.name: getattr(plant, each.name) for each in fields(PlantParameters)}
    return replace(scenario, vessel_sim=replace(scenario.vessel_sim, **drawn_values))


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


@pytest.mark.parametrize("seed", rest_long(range(20), 6))
def test_the_compiled_plant_is_bit_identical_to_the_interpreted_one(seed: int) -> None:
    scenario = scenario_of(drawn(seed), commands(seed))
    loops = [make_loop(scenario, STEPS, interpreted=interpreted) for interpreted in (False, True)]
    assert not available() or isinstance(loops[0], CompiledLoop)
    for loop in loops:
        loop.advance(STEPS)
        assert loop.done == STEPS
    compiled, interpreted = (loop.columns() for loop in loops)
    np.testing.assert_array_equal(interpreted["command"], commands(seed))
    for name, expected in interpreted.items():
        # As integers, so that also the signs of zeros are compared.
        found = np.ascontiguousarray(compiled[name]).view(np.int64)
        np.testing.assert_array_equal(found, np.ascontiguousarray(expected).view(np.int64), name)


def test_a_compiled_motion_that_is_not_finite_is_reported_as_by_the_simulator() -> None:
    scenario = scenario_of(PlantParameters(), np.array([(1e5, 0.0)] * 3 + [(1e15, 1e15)] * 20))
    ends = []
    for interpreted in (False, True):
        loop = make_loop(scenario, 23, interpreted=interpreted)
        with pytest.raises(SimulationError) as raised:
            loop.advance(23)
        ends.append((str(raised.value), loop.done))
        assert 3 < loop.done < 23
        assert np.isfinite(loop.columns()["state"]).all()
    assert ends[0] == ends[1]
