import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from vessel_hsmc_ros.plant.dynamics import damping_force, derivative
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names
from vessel_hsmc_ros.studies.vessel_figures import Figures, agreement, agrees, figures, markdown, steady_motion

DOCS = Path(__file__).parents[3] / "docs" / "vessels.md"

LIMITED = [name for name in vessel_names() if name != "paper_ship"]


@cache
def of(name: str) -> Figures:
    return figures(read_vessel(name))


@pytest.mark.parametrize("name", vessel_names())
def test_a_published_figure_that_is_not_reached_is_named_as_unverified(name: str) -> None:
    vessel = read_vessel(name)
    open_points = " ".join(vessel.unverified)
    for figure, difference in agreement(vessel, of(name)).items():
        assert agrees(figure, difference) or figure.replace("_", " ") in open_points


@pytest.mark.parametrize(("name", "most"), [("top_speed", 0.05), ("towing_sway_damping", 0.3)])
def test_a_figure_agrees_within_its_share_whether_it_is_too_large_or_too_small(name: str, most: float) -> None:
    assert [agrees(name, side * share * most) for share in (0.99, 1.01) for side in (1.0, -1.0)] == [True, True, False, False]


def test_the_speeds_that_the_files_state_are_those_of_the_hulls() -> None:
    assert of("otter").top_speed == pytest.approx(6 * 0.5144, rel=1e-3)
    assert of("gunnerus").top_speed == pytest.approx(12.6 * 1852 / 3600, rel=0.01)
    assert of("heron").top_speed == pytest.approx(2.8, abs=0.05)
    assert of("wam_v_16").top_speed == pytest.approx(5.3, abs=0.05)
    assert of("viknes_830").top_speed == pytest.approx(9.7, abs=0.05)
    assert of("supply_vessel").top_speed == pytest.approx(20.7, abs=0.05)


def test_towing_tests_of_the_enterprise_agree_within_what_its_file_states() -> None:
    found = of("cybership_enterprise")
    assert (found.towing_surge_damping, found.towing_sway_damping) == pytest.approx((0.69, 3.3), abs=0.01)


@pytest.mark.parametrize("name", LIMITED)
def test_a_steady_speed_is_one_at_which_damping_takes_the_force(name: str) -> None:
    vessel = read_vessel(name).hull().coefficients()
    assert damping_force(of(name).top_speed, 0.0, 0.0, vessel)[0] == pytest.approx(of(name).surge_force)
    assert damping_force(of(name).half_speed, 0.0, 0.0, vessel)[0] == pytest.approx(0.5 * of(name).surge_force)


@pytest.mark.parametrize("name", LIMITED)
def test_a_positive_moment_turns_every_vessel_to_port_and_the_mirrored_one_to_starboard(name: str) -> None:
    hull = read_vessel(name).hull()
    vessel = hull.coefficients()
    port = steady_motion(vessel, 0.2 * hull.surge_force_limit, 0.1 * hull.yaw_moment_limit)
    starboard = steady_motion(vessel, 0.2 * hull.surge_force_limit, -0.1 * hull.yaw_moment_limit)
    assert port[2] > 0.0
    assert starboard == pytest.approx((port[0], -port[1], -port[2]), rel=1e-4)


@pytest.mark.parametrize("name", LIMITED)
def test_vessels_drift_outward_in_a_turn(name: str) -> None:
    assert 0.0 < of(name).turn_drift < 0.5 * math.pi


@pytest.mark.parametrize("name", LIMITED)
def test_a_yaw_moment_leaves_the_pivot_point_without_sway_acceleration(name: str) -> None:
    rates = derivative(np.zeros(6), (0.0, 0.0, 1e-3), (0.0,) * 3, read_vessel(name).hull().coefficients())
    assert rates[4] + of(name).percussion_point * rates[5] == pytest.approx(0.0, abs=1e-9 * abs(rates[5]))


def test_damping_takes_energy_from_every_vessel_but_the_cyberships() -> None:
    active = [name for name in vessel_names() if of(name).energy_gain > 0.0]
    assert active == ["cybership2", "cybership_enterprise"]
    assert all("not positive semidefinite" in " ".join(read_vessel(name).unverified) for name in active)


def test_figures_that_need_a_missing_limit_are_not_numbers() -> None:
    assert math.isnan(of("paper_ship").top_speed)
    assert math.isnan(of("paper_ship").turning_rate)


@pytest.mark.long
def test_the_tables_in_the_docs_are_those_that_the_command_prints() -> None:
    assert markdown() in DOCS.read_text(encoding="utf-8")
