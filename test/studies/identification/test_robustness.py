"""Identification finds the ship from short manoeuvres, noisy accelerations and poor starts, where its motion is unstable too."""

from functools import cache

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.scenario.own_ship import ship_of
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.identification import estimate
from vessel_hsmc_ros.studies.identification.estimate import Shooting, identify, refine
from vessel_hsmc_ros.studies.identification.excitation import excitation, scenario_text
from vessel_hsmc_ros.studies.identification.measurements import from_run
from vessel_hsmc_ros.studies.identification.regression import natural_scale, regress
from vessel_hsmc_ros.studies.identification.types import Identified, Measurements, model, smooth, unknowns, windows

OTTER = {"surge_inertia": 60.28, "sway_inertia": 137.5, "yaw_inertia": 39.325, "surge_damping": 77.554}


@cache
def otter(rate_hz: float) -> Measurements:
    """The Otter, driven by surge force and yaw moment alone, under the manoeuvres of `vessel-hsmc excite` with their noise."""
    scale = scale_of(ship_of(read_vessel("otter").values))
    text = scenario_text("otter_excite", "otter", "    vessel: otter", scale, excitation(scale))
    text = text.replace("rate_hz: 50.0", f"rate_hz: {rate_hz}")
    return from_run(simulate(parse_scenario(text, "otter_excite")))


@cache
def identified(name: str, window: float) -> Identified:
    return identify([otter(10.0)], model(name), window=window)


@pytest.mark.parametrize("rate_hz", [10.0, 50.0])
@pytest.mark.parametrize("name", ["paper", "linear", "coupled"])
def test_the_regression_starts_near_a_ship_without_an_input_in_sway(name: str, rate_hz: float) -> None:
    run = otter(rate_hz)
    free = unknowns(model(name), None)
    values = free.values(regress(free, [(run, smooth(run))]))
    for parameter, true in OTTER.items():
        assert values[parameter] == pytest.approx(true, rel=0.5)


@pytest.mark.parametrize("name", rest_long(["paper", "linear", "coupled"]))
def test_manoeuvres_at_10_hz_identify_the_ship_by_each_model(name: str) -> None:
    found = identified(name, 5.0)
    for parameter, true in OTTER.items():
        # The linear model puts the Otter's quadratic damping into what it has: its sway and yaw are other numbers.
        if name != "linear" or parameter.startswith("surge"):
            assert found.values[parameter] == pytest.approx(true, rel=0.15)
        assert 0.0 < found.values[parameter] < 3.0 * true


def shooting(run: Measurements, length: float) -> Shooting:
    smoothed, free = smooth(run), unknowns(model("paper"), None)
    cut = windows([run], length)
    scale = natural_scale(free, [(run, smoothed)])
    return Shooting(free, cut, length, smoothed.states[cut.begin], 3.0 * smoothed.error, smoothed.noise, scale)


def test_a_start_from_which_the_motion_diverges_is_replaced_by_a_heavier_ship() -> None:
    problem = shooting(otter(10.0), 2.0)
    stiff = np.array([1e-3, 1e-3, 1e-3, *[100.0] * 9])
    assert not np.isfinite(problem.residuals(stiff)).all()
    values = problem.unknowns.values(refine(problem, stiff))
    for parameter, true in OTTER.items():
        assert values[parameter] == pytest.approx(true, rel=0.25)


def test_a_motion_that_diverges_from_every_start_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(estimate, "DIVERGED", 0.0)
    with pytest.raises(IdentificationError, match="the simulated motion diverges"):
        refine(shooting(otter(10.0), 2.0), np.ones(12))


@pytest.mark.long
def test_windows_are_shortened_for_a_hull_that_does_not_keep_its_course_with_a_warning() -> None:
    found = identified("linear", 5.0)
    assert any("within 5 s" in line for line in found.warnings)
    assert not any("within 2 s" in line for line in identified("linear", 2.0).warnings)
