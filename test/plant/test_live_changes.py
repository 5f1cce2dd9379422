"""Disturbances changed while the ship moves: they act, and no phase jumps."""

from dataclasses import replace

import numpy as np
import pytest

from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.plant.disturbance import (
    CurrentParameters,
    EarthFixedParameters,
    PeriodicParameters,
    WaveParameters,
    drift_force,
    make_sea,
    with_waves,
)
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters, PlantParameters, Simulator

PERIOD = 0.01
CALM = PeriodicParameters(0.0, 0.0, 0.0)


def simulator(**disturbance: object) -> tuple[Simulator, DisturbanceParameters]:
    loads = replace(DisturbanceParameters(periodic=CALM), **disturbance)  # type: ignore[arg-type]
    return Simulator(PlantParameters(disturbance=loads), PERIOD), loads


def test_a_changed_frequency_leaves_the_phase_of_the_periodic_disturbance_continuous() -> None:
    plant, loads = simulator(periodic=PeriodicParameters(frequency=0.3))
    before = plant.disturbance(100.0)
    plant.retune(replace(loads, periodic=PeriodicParameters(frequency=3.0)), 100.0)
    assert plant.disturbance(100.0) == pytest.approx(before)
    quarter = 0.5 * np.pi / 3.0
    phase = 0.3 * 100.0
    assert plant.disturbance(100.0 + quarter)[0] == pytest.approx(11e2 * (1.0 + np.sin(phase + 0.5 * np.pi)))


def test_at_each_of_several_changes_of_frequency_and_current_all_loads_are_continuous() -> None:
    plant, loads = simulator(periodic=PeriodicParameters(frequency=0.3), waves=WaveParameters(significant_height=1.5))
    time, changes = 0.0, ((3.0, 0.5, -0.2), (0.7, 0.5, 0.9), (0.0, -1.0, 0.9), (0.3, 0.0, 0.0))
    for frequency, east, north in changes:
        time += 41.7
        before = plant.disturbance(time)
        loads = replace(loads, periodic=PeriodicParameters(frequency=frequency), current=CurrentParameters(east, north))
        plant.retune(loads, time)
        assert plant.disturbance(time) == pytest.approx(before, rel=1e-9)
        assert plant.disturbance(time + 2.0) != pytest.approx(before, rel=1e-3)


def test_a_changed_mean_takes_effect_immediately() -> None:
    plant, loads = simulator(periodic=PeriodicParameters(frequency=0.0))
    plant.retune(replace(loads, periodic=PeriodicParameters(surge_force=7.0, frequency=0.0)), 5.0)
    assert plant.disturbance(5.0) == (7.0, 26e2, 950e2)


def test_wind_can_be_switched_on_and_retuning_keeps_the_present_gusts() -> None:
    plant, loads = simulator()
    assert plant.disturbance(0.0) == (0.0, 0.0, 0.0)
    plant.retune(replace(loads, earth_fixed=EarthFixedParameters(gust_deviation=100.0)), 0.0)
    gust = plant.disturbance(0.0)
    assert any(gust)
    plant.retune(replace(loads, earth_fixed=EarthFixedParameters(east_force=50.0)), 0.0)
    shifted = np.array(plant.disturbance(0.0)) - gust
    assert np.hypot(shifted[0], shifted[1]) == pytest.approx(50.0)


def test_a_changed_current_carries_the_ship_and_leaves_the_phases_of_the_waves_continuous() -> None:
    sea = make_sea(WaveParameters(significant_height=2.0), np.random.default_rng(0), ShipParameters())
    motion, time = Motion(10.0, 3.0, 0.2, 0.0, 0.0, 0.0), 200.0
    old, new = (0.5, -0.2), (-1.0, 0.4)
    changed = sea.with_current((new[0] - old[0], new[1] - old[1]), time)
    assert drift_force(time, motion, new, changed) == pytest.approx(drift_force(time, motion, old, sea), rel=1e-9)
    assert with_waves(time, motion, new, changed)[:3] == pytest.approx(with_waves(time, motion, old, sea)[:3], rel=1e-12)

    plant, loads = simulator(current=CurrentParameters(east=1.0))
    plant.retune(replace(loads, current=CurrentParameters(east=-1.0)), 0.0)
    start = plant.state[0]
    plant.advance((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    for _ in range(500):
        plant.advance((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert plant.state[0] < start


def test_unchanged_disturbances_stay_bit_identical() -> None:
    plant, loads = simulator(periodic=PeriodicParameters(), earth_fixed=EarthFixedParameters(gust_deviation=10.0))
    other, _ = simulator(periodic=PeriodicParameters(), earth_fixed=EarthFixedParameters(gust_deviation=10.0))
    plant.retune(loads, 3.0)
    assert plant.disturbance(4.0) == other.disturbance(4.0)
