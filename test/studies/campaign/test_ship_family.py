"""The family of ships: scaling, what is declared, references, and campaigns with variants of a draw."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaigns import campaign
from durations import rest_long
from ship_family import KNOWLEDGE, REFERENCES, ShipFamily, expand, ship_of

from vessel_hsmc_ros.core.exceptions import InstallationError, ParameterError
from vessel_hsmc_ros.guidance.factory import trajectory
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.studies.batch import simulate_one
from vessel_hsmc_ros.studies.campaign import distributions
from vessel_hsmc_ros.studies.campaign import plan as plans
from vessel_hsmc_ros.studies.campaign.plan import Campaign

DELAYED = ShipFamily(
    has_lag=True, has_rate=True, has_dead_time=True, coupled=True, percussion_point=0.03, declares_lag=True, declared_lag=0.5,
    declared_rate=1.5, declared_dead_time=0.7, declared_coupling=1.2, declared_yaw_inertia=0.9, yaw_delays=1.2,
)  # fmt: skip


LOADS: dict[str, Any] = {"has_current": True, "current": 0.1, "has_wind": True, "wind": 0.05, "wind_direction": 1.0}
NO_GUSTS = {"vessel_sim.disturbance.earth_fixed.gust_deviation": 0.0}


def scenario(family: ShipFamily, **changes: object) -> Scenario:
    return load_scenario("case2_tracking", {"controller.law": "guided", **expand(family), **changes})


def test_the_default_is_the_ship_of_the_paper() -> None:
    ship, paper = scenario(ShipFamily(surge_to_sway_inertia=120e3 / 177.9e3)).vessel_sim.vessel, load_scenario("case2_tracking")
    ours, theirs = ship.coefficients(), paper.vessel_sim.vessel.coefficients()
    assert ours == pytest.approx(theirs, rel=1e-12)


@pytest.mark.parametrize("reference", rest_long(REFERENCES, 2))
def test_a_scaled_ship_moves_alike_in_its_own_units(reference: str) -> None:
    # Froude's law with four times the length: all times twice as long, so that half the rate gives the same steps.
    family = replace(DELAYED, reference=reference, knowledge="everything", to_port=False, **LOADS)
    found = []
    for length, rate in ((8.0, 40.0), (32.0, 20.0)):
        changes = {"vessel_sim.duration": 40.0 * math.sqrt(length / 8.0), **NO_GUSTS}
        metrics = simulate_one(scenario(replace(family, length=length, control_rate_hz=rate), **changes)).metrics
        assert metrics is not None
        found.append(
            (metrics.position_error_rms / length, metrics.surge_force_rms / length**3, metrics.yaw_moment_rms / length**4)
        )
    assert found[0] == pytest.approx(found[1], rel=1e-2)


def test_what_is_declared_follows_the_knowledge() -> None:
    true = scenario(DELAYED)
    known = {name: scenario(replace(DELAYED, knowledge=name)).controller.vessel for name in KNOWLEDGE}
    a, hull = true.vessel_sim.actuators, true.vessel_sim.vessel
    # surge lag, rate, dead time; yaw inertia; coupling
    found = {
        name: (v.surge_lag, v.yaw_moment_rate, v.surge_dead_time, v.yaw_inertia, v.sway_yaw_inertia) for name, v in known.items()
    }
    assert found == {
        "declared": (0.5 * a.surge_lag, -1.0, -1.0, 0.9 * hull.yaw_inertia, 0.0),
        "nothing": (-1.0, -1.0, -1.0, 0.9 * hull.yaw_inertia, 0.0),
        "everything": (a.surge_lag, a.yaw_moment_rate, a.surge_dead_time, hull.yaw_inertia, hull.sway_yaw_inertia),
        "true_values": (a.surge_lag, -1.0, -1.0, hull.yaw_inertia, 0.0),
    }
    assert all((v.length, v.yaw_moment_limit) == (hull.length, a.yaw_moment_limit) for v in known.values())


def test_each_actuator_has_its_own_delays_and_each_declaration_its_own_error() -> None:
    family = replace(
        DELAYED, surge_delays=0.5, yaw_delays=3.0, lag=0.11, time_to_full=1.3, dead_time=0.4,
        declares_rate=True, declares_dead_time=True, declares_coupling=True,
        declared_surge_inertia=1.1, declared_sway_inertia=1.3,
    )  # fmt: skip
    made, ship = scenario(family), ship_of(family)
    T, F, N = ship.scale.T, ship.scale.F, ship.scale.N
    for own, limit, axis, rate in ((0.5, F, "surge", "surge_force_rate"), (3.0, N, "yaw", "yaw_moment_rate")):
        a, declared = made.vessel_sim.actuators, made.controller.vessel
        true = getattr(a, f"{axis}_lag"), getattr(a, rate), getattr(a, f"{axis}_dead_time")
        assert true[:2] == pytest.approx((own * 0.11 * T, limit / (own * 1.3 * T)))
        assert true[2] == pytest.approx(own * 0.4 * T, abs=0.6 * ship.period)
        known = getattr(declared, f"{axis}_lag"), getattr(declared, rate), getattr(declared, f"{axis}_dead_time")
        assert known == pytest.approx((0.5 * true[0], 1.5 * true[1], 0.7 * true[2]))
    hull = ship.hull
    inertias = declared.surge_inertia, declared.sway_inertia, declared.yaw_inertia, declared.sway_yaw_inertia
    true_ones = 1.1 * hull.surge_inertia, 1.3 * hull.sway_inertia, 0.9 * hull.yaw_inertia, 1.2 * hull.sway_yaw_inertia
    assert inertias == pytest.approx(true_ones)


@pytest.mark.parametrize("reference", rest_long(REFERENCES, 2))
def test_a_reference_to_starboard_is_the_mirror_image_of_that_to_port(reference: str) -> None:
    families = [ShipFamily(reference=reference, to_port=side) for side in (True, False)]
    count = max(100, math.ceil(0.6 * ship_of(families[0]).course.period))
    port, starboard = (trajectory(scenario(family).reference_ship, 1.0, count) for family in families)
    mirror = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    np.testing.assert_allclose(starboard[:, :6], port[:, :6] * mirror, atol=1e-6)
    turns = np.ptp(port[:, 2]) > 0.1
    assert turns == (reference not in ("straight", "rest"))
    if turns:
        first = np.flatnonzero(np.abs(port[:, 2]) > 0.05)[0]
        assert port[first, 2] > 0.0


def test_what_a_ship_has_not_is_declared_exactly_as_none() -> None:
    declared = replace(ShipFamily(), declares_lag=True, declares_rate=True, declares_dead_time=True, declared_lag=1.5)
    vessel = scenario(declared).controller.vessel
    assert (vessel.yaw_lag, vessel.yaw_moment_rate, vessel.yaw_dead_time) == (0.0, math.inf, 0.0)


def test_a_hull_that_drifts_is_declared_as_init_declares_it() -> None:
    drifting = replace(ShipFamily(), sway_damping=0.3, surge_to_sway_inertia=1.1, knowledge="everything")
    exact = scenario(drifting).controller.vessel
    assert exact.sway_damping_rate > 0.0
    assert exact.coriolis_ratio > 0.6
    wrong = replace(drifting, knowledge="declared", declares_sway_damping=True, declared_sway_damping_rate=0.5)
    assert scenario(wrong).controller.vessel.sway_damping_rate == pytest.approx(0.5 * exact.sway_damping_rate)
    assert scenario(replace(wrong, declares_sway_damping=False)).controller.vessel.sway_damping_rate == -1.0


@pytest.mark.parametrize("dead_time", [0.005, 0.02, 0.3])
def test_a_dead_time_is_whole_periods_of_the_plant_and_never_lost(dead_time: float) -> None:
    ship = ship_of(
        replace(ShipFamily(), has_dead_time=True, dead_time=dead_time, yaw_delays=0.8, control_rate_hz=10.0, length=1.2)
    )
    periods = ship.yaw.dead_time / ship.period
    assert periods >= 1.0
    assert periods == pytest.approx(round(periods), abs=1e-9)
    assert abs(ship.yaw.dead_time - 0.8 * dead_time * ship.scale.T) <= 0.5 * ship.period


@pytest.mark.parametrize("reference", REFERENCES)
def test_an_expansion_changes_the_same_parameters_whatever_it_is(reference: str) -> None:
    assert expand(replace(DELAYED, reference=reference, noisy=True)).keys() == expand(ShipFamily()).keys()


VARIANTS = {"all": {"ship.knowledge": "everything"}, "none": {"ship.knowledge": "nothing", "controller.law": "los_pid"}}
DRAW = {"ship.length": {"loguniform": [2.0, 50.0]}, "ship.has_lag": {"choice": [True]}, "ship.noisy": {"choice": [False, True]}}


def drawn(folder: Path, **changes: Any) -> Campaign:
    given = {"laws": None, "variants": VARIANTS, "draw": DRAW, "set": {"controller.law": "guided"}, **changes}
    return campaign(folder, limits={"position_error_rms_last_quarter": {"lengths": 0.02}}, **given)


def test_variants_of_a_draw_share_ship_noise_and_reference(tmp_path: Path) -> None:
    plan = drawn(tmp_path)
    assert (plan.runs, plan.laws, plan.variant_column) == (10, ("guided", "los_pid"), "variant")
    one, other = plan.scenario(6), plan.scenario(7)
    assert one.vessel_sim == other.vessel_sim
    assert one.reference_ship == other.reference_ship
    assert (one.controller.law, other.controller.law) == ("guided", "los_pid")
    assert one.controller.vessel.yaw_lag == one.vessel_sim.actuators.yaw_lag
    assert other.controller.vessel.yaw_lag == -1.0
    assert plan.limits_of(one) == {"position_error_rms_last_quarter": 0.02 * one.vessel_sim.vessel.length}


def test_what_the_file_sets_by_name_is_above_the_expansion(tmp_path: Path) -> None:
    plan = drawn(tmp_path, set={"controller.law": "guided", "vessel_sim.duration": 3.0, "ship.reference": "rest"})
    assert plan.scenario(0).vessel_sim.duration == 3.0
    assert plan.scenario(0).reference_ship.mode == "virtual_ship"


def test_another_seed_makes_another_campaign(tmp_path: Path) -> None:
    drawn(tmp_path)
    first, other = (Campaign.load(tmp_path / "small.yaml", seed=seed) for seed in (None, 2))
    assert other.seed == 2
    assert other.digest != first.digest
    assert not np.isclose(first.values(0)["ship.length"], other.values(0)["ship.length"])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"laws": ["guided"]}, r"laws cannot be given with variants \(got \['guided'\]\)"),
        ({"variants": {"one": 3}}, "variants: one must be .*got 3"),
        ({"draw": {"ship.width": {"uniform": [1, 2]}}}, "draw ship.width is not a number of a ship"),
        ({"draw": {"ship.radius": {"uniform": [0.1, 0.2]}}}, "draw ship.radius must have values that are"),
        ({"limits": {"position_error_rms": {"feet": 1}}}, r"limits: position_error_rms must be .*got \{'feet': 1\}"),
        ({"set": {"ship.reference": "spiral"}}, "ship.reference must be .*got spiral"),
    ],
)
def test_a_wrong_entry_is_one_line_that_names_it(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    given = {"laws": None, "variants": VARIANTS, "draw": DRAW, "set": {"controller.law": "guided"}, **changes}
    with pytest.raises(ParameterError, match=message):
        campaign(tmp_path, **given)


def test_a_campaign_of_a_family_that_is_not_installed_is_refused_with_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(distributions, "entry_points", lambda **_: ())
    anew = distributions.ship_family.__wrapped__
    for module in (distributions, plans):
        monkeypatch.setattr(module, "ship_family", anew)
    for given in ({}, {"variants": None, "set": {"ship.length": 2.0}, "draw": {}}):
        with pytest.raises(InstallationError, match=r"pip install \./benchmarks/ship_family"):
            drawn(tmp_path, **given)
