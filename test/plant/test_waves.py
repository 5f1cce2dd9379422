import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, as_motion
from vessel_hsmc_ros.plant.disturbance import (
    WATER_DENSITY,
    WaveParameters,
    advanced,
    drift_force,
    frequencies,
    make_sea,
    spectrum,
    with_waves,
)
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters

REST = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
STILL = (0.0, 0.0)
PEAK = 2.0 * math.pi / 6.0


def waves(seed=1, **parameters):
    return make_sea(WaveParameters(**{"significant_height": 1.0, **parameters}), np.random.default_rng(seed), ShipParameters())


def one_wave(**parameters):
    """A regular wave of random frequency and phase."""
    return waves(components=1, **parameters)


def elevation(sea, time, motion=REST, current=STILL):
    """The surface elevation at a hull without draught, m."""
    k, omega, epsilon, orbit, _ = np.transpose(sea.components)
    return np.sum(orbit * np.cos(k * advanced(time, motion, current, sea) - omega * time + epsilon))


@pytest.mark.parametrize("gamma", [1.0, 3.3])
def test_the_spectrum_has_the_energy_of_the_significant_height(gamma: float) -> None:
    omega = np.linspace(0.05, 30.0, 100_000)
    energy = np.trapezoid(spectrum(omega, 2.0, PEAK, gamma), omega)
    assert 4.0 * math.sqrt(energy) == pytest.approx(2.0, rel=0.01)  # the usual normalisation is good to a per cent


def test_the_pierson_moskowitz_energy_distribution_matches_its_closed_form() -> None:
    shares = np.linspace(0.02, 0.98, 25)
    below_the_cut = shares * math.exp(-1.25 / 6.0**4)  # the last thousandth, above six times the peak's frequency, is left out
    expected = PEAK * (1.25 / -np.log(below_the_cut)) ** 0.25
    np.testing.assert_allclose(frequencies(shares, PEAK, 1.0), expected, rtol=3e-3)


def test_a_jonswap_peak_is_narrower_and_at_its_frequency() -> None:
    omega = np.linspace(0.5, 2.0, 3001)
    assert omega[np.argmax(spectrum(omega, 1.0, PEAK, 3.3))] == pytest.approx(PEAK, abs=1e-3)
    spread = [float(np.subtract(*frequencies(np.array([0.75, 0.25]), PEAK, gamma))) for gamma in (1.0, 3.3)]
    assert spread[1] < 0.7 * spread[0]


def test_the_elevation_has_the_significant_height() -> None:
    heights = []
    for seed in range(10):
        sea = waves(seed, components=60, hull_draught=1e-3)
        heights.append(4.0 * np.std([elevation(sea, t) for t in np.arange(0.0, 600.0, 0.5)]))
    assert np.mean(heights) == pytest.approx(1.0, rel=0.05)
    assert np.max(np.abs(np.array(heights) - 1.0)) < 0.25


@given(
    st.tuples(*[st.floats(-100.0, 100.0)] * 2, st.floats(-7.0, 7.0), *[st.floats(-3.0, 3.0)] * 2).map(list),
    st.floats(-3.0, 3.0),
    st.floats(0.0, 1000.0),
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
)
def test_velocities_are_the_rates_of_the_pose(ship: list[float], direction: float, time, current) -> None:
    """For a ship of constant heading: the yaw rate of the hull is neglected against the wave frequencies."""
    sea = waves(direction=direction)
    motion = as_motion([*ship, 0.0])
    c, s = math.cos(motion.psi), math.sin(motion.psi)
    v_x, v_y = motion.u * c - motion.v * s, motion.u * s + motion.v * c
    h = 1e-4
    places = [motion._replace(x=motion.x + d * v_x, y=motion.y + d * v_y) for d in (-h, h)]
    before, after = (np.array(with_waves(time + d, place, current, sea)) for d, place in zip((-h, h), places, strict=True))
    rates = (after - before)[:3] / (2.0 * h)
    _, _, psi, u, v, r = with_waves(time, motion, current, sea)
    c, s = math.cos(psi), math.sin(psi)
    np.testing.assert_allclose(rates, [u * c - v * s, u * s + v * c, r], atol=1e-5)


@pytest.mark.long
def test_the_hull_follows_long_waves_like_a_water_particle() -> None:
    sea = one_wave(peak_period=30.0, hull_length=0.5, hull_draught=0.01)
    amplitude = 1.0 / math.sqrt(8.0)
    track = np.array([with_waves(t, REST, STILL, sea) for t in np.arange(0.0, 300.0, 0.1)])
    assert np.max(track[:, 0]) == pytest.approx(amplitude, rel=0.01)
    assert not track[:, 1:3].any()


def test_a_long_hull_filters_short_waves() -> None:
    long, short = (np.std([with_waves(t, REST, STILL, one_wave(peak_period=T))[0] for t in range(200)]) for T in (12.0, 2.0))
    assert short < 0.05 * long


def test_oblique_waves_turn_the_ship_and_head_seas_do_not() -> None:
    bow, ahead = (waves(direction=d) for d in (0.75 * math.pi, math.pi))
    turns = [np.ptp([with_waves(t, REST, STILL, sea)[2] for t in np.arange(0.0, 60.0, 0.2)]) for sea in (bow, ahead)]
    assert turns[0] > 0.01
    assert turns[1] < 1e-12


@given(st.floats(-7.0, 7.0))
def test_the_wave_motion_is_continuous_in_beam_seas(direction: float) -> None:
    a, b = (with_waves(3.0, REST, STILL, waves(direction=direction + d)) for d in (0.0, 1e-7))
    np.testing.assert_allclose(a, b, atol=1e-6)


def test_the_mean_drift_force_of_short_beam_seas_is_that_of_a_reflecting_wall() -> None:
    sea = one_wave(peak_period=1.5, direction=math.pi / 2)
    mean = np.mean([drift_force(t, REST, STILL, sea)[1] for t in np.arange(0.0, 100.0, 0.1)])
    assert mean == pytest.approx(0.5 * WATER_DENSITY * GRAVITY * 32.0 / 8.0, rel=0.01)


def test_the_drift_force_varies_in_magnitude_but_not_in_direction() -> None:
    sea = waves(direction=math.pi / 2)
    forces = np.array([drift_force(t, REST, STILL, sea) for t in np.arange(0.0, 300.0, 0.5)])
    assert np.all(forces[:, 1] >= 0.0)
    assert np.max(np.abs(forces[:, 0])) < 1e-9
    assert forces[:, 1].std() > 0.3 * forces[:, 1].mean()


def test_two_waves_beat_at_the_difference_of_their_frequencies() -> None:
    sea = waves(direction=math.pi / 2, components=2)
    time = np.arange(0.0, 1000.0, 0.5)
    force = np.array([drift_force(t, REST, STILL, sea)[1] for t in time])
    lines = np.abs(np.fft.rfft((force - force.mean()) * np.hanning(len(force))))
    strongest = 2.0 * math.pi * np.fft.rfftfreq(len(force), 0.5)[np.argmax(lines)]
    assert strongest == pytest.approx(abs(sea.components[0][1] - sea.components[1][1]), abs=2.0 * math.pi / 1000.0)


def test_waves_are_carried_by_the_current() -> None:
    sea, current = waves(), (0.5, 0.2)
    carried = Motion(10.0 * 0.5, 10.0 * 0.2, 0.3, 0.0, 0.0, 0.0)
    assert elevation(sea, 10.0, carried, current) == pytest.approx(elevation(sea, 10.0))


@pytest.mark.parametrize("encounter", [0.0, 0.3, math.pi / 4, 2.0, math.pi, -1.0])
def test_the_drift_force_is_proportional_to_squared_direction_cosines(encounter: float) -> None:
    """With the envelope E: B·E·cos beta·|cos beta| along and L·E·sin beta·|sin beta| across the hull, both down-wave."""
    _, beam_sea, _ = drift_force(7.0, REST, STILL, one_wave(direction=math.pi / 2, hull_length=32.0, hull_beam=8.0))
    surge, sway, yaw = drift_force(7.0, REST, STILL, one_wave(direction=encounter, hull_length=32.0, hull_beam=8.0))
    along, across = math.cos(encounter), math.sin(encounter)
    assert beam_sea > 0.0
    assert sway == pytest.approx(beam_sea * across * abs(across))
    assert surge == pytest.approx(0.25 * beam_sea * along * abs(along))
    assert yaw == 0.0
