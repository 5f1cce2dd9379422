"""The campaign file, and the runs that it defines."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaigns import FORCE, INERTIA, SEED, X, campaign, campaign_file

from vessel_hsmc_ros import load_scenario
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError, VesselHsmcError
from vessel_hsmc_ros.studies.campaign.plan import Campaign

METHODS = ("random", "latin_hypercube", "sobol")
LAG = "vessel_sim.actuators.yaw_lag"


@pytest.mark.parametrize("method", METHODS)
def test_a_run_is_a_function_of_its_number_alone(tmp_path: Path, method: str) -> None:
    first, second = (campaign(tmp_path, sampling=method, runs=3000) for _ in range(2))
    numbers = [5999, 0, 2048, 2047, 17]
    planned = {run: first.planned(run) for run in numbers}
    assert planned == {run: second.planned(run) for run in sorted(numbers)}
    assert first.scenario(17) == second.scenario(17)


@pytest.mark.parametrize("method", ["random", "sobol"])
def test_a_longer_campaign_begins_with_the_runs_of_a_shorter_one(tmp_path: Path, method: str) -> None:
    short, long = (campaign(tmp_path, sampling=method, runs=runs) for runs in (5, 1500))
    assert [short.planned(run) for run in range(10)] == [long.planned(run) for run in range(10)]
    assert short.digest == long.digest


def test_a_latin_hypercube_has_one_draw_in_each_stratum(tmp_path: Path) -> None:
    plan = campaign(tmp_path, sampling="latin_hypercube", runs=20, draw={X: {"uniform": [0, 20]}})
    assert sorted(int(plan.values(draw)[X]) for draw in range(20)) == list(range(20))
    assert plan.digest != campaign(tmp_path, sampling="latin_hypercube", runs=21, draw={X: {"uniform": [0, 20]}}).digest


def test_the_laws_of_a_draw_share_its_values_and_its_noise(tmp_path: Path) -> None:
    plan = campaign(tmp_path)
    assert (plan.runs, plan.draws, plan.laws, plan.drawn) == (10, 5, ("los_pid", "hierarchical_printed"), (INERTIA, X))
    one, other = plan.planned(6), plan.planned(7)
    assert (one.draw, one.law, other.law) == (3, "los_pid", "hierarchical_printed")
    assert (one.seed, one.values) == (other.seed, other.values)


def test_every_draw_has_noise_of_its_own(tmp_path: Path) -> None:
    plan = campaign(tmp_path, runs=500)
    assert len({plan.planned(run).seed for run in range(0, 1000, 2)}) == 500
    assert plan.scenario(3).vessel_sim.seed == plan.planned(3).seed


def test_a_seed_that_is_set_or_drawn_is_that_of_the_run(tmp_path: Path) -> None:
    fixed = campaign(tmp_path, set={"vessel_sim.duration": 0.5, SEED: 7})
    assert {fixed.planned(run).seed for run in range(10)} == {7}
    drawn = campaign(tmp_path, draw={SEED: {"choice": [3, 4]}})
    assert all(drawn.planned(run).seed == drawn.planned(run).values[SEED] for run in range(10))


def test_a_relative_value_is_a_factor_on_the_base_value(tmp_path: Path) -> None:
    plan, base = campaign(tmp_path, runs=50), load_scenario("case2_tracking").controller.vessel.surge_inertia
    factors = [plan.scenario(run).controller.vessel.surge_inertia / base for run in range(0, 100, 20)]
    assert all(0.8 <= factor <= 1.2 for factor in factors)
    assert len(set(factors)) == 5


def test_an_element_of_a_list_leaves_the_others(tmp_path: Path) -> None:
    plan = campaign(tmp_path)
    assert plan.scenario(2).vessel_sim.initial_pose == (plan.values(1)[X], 1.0, math.pi / 4)


def test_values_stay_in_the_range_of_the_parameter(tmp_path: Path) -> None:
    plan = campaign(tmp_path, runs=300, draw={LAG: {"normal": [0.0, 1.0]}, "vessel_sim.seed": {"uniform": [0, 2]}})
    values = [plan.values(draw) for draw in range(300)]
    assert all(value[LAG] >= 0.0 for value in values)
    assert np.mean([value[LAG] for value in values]) == pytest.approx(math.sqrt(2.0 / math.pi), abs=0.1)  # the half normal
    seeds = [value["vessel_sim.seed"] for value in values]
    assert {type(seed) for seed in seeds} == {int}
    assert all(70 < seeds.count(seed) < 130 for seed in (0, 1, 2))


def test_grids_are_combined_and_other_parameters_drawn_for_each(tmp_path: Path) -> None:
    y = "vessel_sim.initial_pose[1]"
    draw = {X: {"grid": [0, 2, 3]}, FORCE: {"normal": [0, 1]}, y: {"grid": [-1, 1, 2]}}
    plan = campaign(tmp_path, runs=2, draw=draw)
    assert (plan.draws, plan.runs) == (12, 24)
    values = [plan.values(number) for number in range(12)]
    assert [(value[X], value[y]) for value in values] == [(x, s) for x in (0.0, 1.0, 2.0) for s in (-1.0, 1.0)] * 2
    assert len({value[FORCE] for value in values}) == 12
    assert campaign(tmp_path, runs=None, draw={X: {"grid": [0, 2, 3]}}).draws == 3


def test_choices_may_be_texts_flags_and_lists(tmp_path: Path) -> None:
    choices = {
        "reference_ship.mode": ["circle", "straight"],
        "controller.observer.enabled": [True, False],
        "vessel_sim.initial_pose": [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]],
    }
    plan = campaign(tmp_path, runs=20, draw={name: {"choice": values} for name, values in choices.items()})
    drawn = [plan.values(draw) for draw in range(20)]
    assert {value["vessel_sim.initial_pose"] for value in drawn} == {(0.0, 0.0, 0.0), (1.0, 2.0, 3.0)}
    scenario = plan.scenario(4)
    assert scenario.reference_ship.mode == drawn[2]["reference_ship.mode"]
    assert scenario.controller.observer.enabled is drawn[2]["controller.observer.enabled"]


def test_hull_data_of_all_nodes_are_drawn_together(tmp_path: Path) -> None:
    plan = campaign(tmp_path, draw={"vessel.sway_inertia": {"uniform": [0.9, 1.1], "relative": True}})
    scenario, value = plan.scenario(0), plan.values(0)["vessel.sway_inertia"]
    assert scenario.vessel_sim.vessel.sway_inertia == scenario.reference_ship.vessel.sway_inertia == value


def test_a_scenario_beside_the_file_is_found_and_part_of_the_campaign(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("/**/vessel_sim: {ros__parameters: {duration: 3.0}}\n")
    plan = campaign(tmp_path, scenario="mine.yaml", set=None)
    assert plan.scenario(0).vessel_sim.duration == 3.0
    (tmp_path / "mine.yaml").write_text("/**/vessel_sim: {ros__parameters: {duration: 4.0}}\n")
    assert Campaign.load(tmp_path / "small.yaml").digest != plan.digest


def test_a_comment_does_not_make_another_campaign(tmp_path: Path) -> None:
    path = campaign_file(tmp_path)
    before = Campaign.load(path).digest
    path.write_text("# why\n" + path.read_text())
    assert Campaign.load(path).digest == before


def test_a_number_of_sobol_draws_that_is_no_power_of_two_is_noted(tmp_path: Path) -> None:
    assert campaign(tmp_path, sampling="sobol", runs=8).notes == []
    assert "8 or 16 draws instead of 10" in campaign(tmp_path, sampling="sobol", runs=10).notes[0]


UNIT = {"uniform": [0, 1]}
HEIGHT, PERIOD = (f"vessel_sim.disturbance.waves.{name}" for name in ("significant_height", "peak_period"))


@pytest.mark.parametrize(
    ("changes", "noted"),
    [
        ({"laws": ["guided"], "draw": {"controller.los_pid.integral_gain": UNIT}}, "controller.law is not los_pid"),
        ({"laws": ["guided", "los_pid"], "draw": {"controller.los_pid.integral_gain": UNIT}}, ""),
        ({"draw": {PERIOD: {"uniform": [3, 4]}}}, f"{PERIOD} is given and has no effect"),
        ({"draw": {PERIOD: {"uniform": [3, 4]}, HEIGHT: {"grid": [0, 1, 2]}}, "runs": 2}, ""),
        ({"draw": {"reference_ship.circle.speed": UNIT, "reference_ship.mode": {"choice": ["circle", "square"]}}}, ""),
    ],
)
def test_drawn_parameters_that_have_no_effect_in_any_variant_are_noted(tmp_path: Path, changes: Any, noted: str) -> None:
    notes = campaign(tmp_path, **changes).notes
    assert noted in "".join(notes)
    assert bool(notes) == bool(noted)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scenario": None}, "campaign small is not a campaign file: its keys must be scenario, set, laws"),
        ({"scenario": "case9"}, "scenario case9 is unknown"),
        ({"scenario": 3}, "scenario must be .*got 3"),
        ({"run": 5}, "run is not a key: did you mean runs"),
        ({"runs": 0}, "runs must be an integer from 1 to.*got 0"),
        ({"runs": None}, "runs must be an integer.*got None"),
        ({"seed": -1}, "seed must be .*got -1"),
        ({"chunk": 1.5}, "chunk must be .*got 1.5"),
        ({"laws": ["lqr"]}, "laws must be any of .*got lqr"),
        ({"laws": ["guided", "guided"]}, "must be different laws"),
        ({"sampling": "halton"}, "sampling must be one of random, latin_hypercube, sobol.*got halton"),
        ({"sampling": "sobol", "draw": {X: {"grid": [0, 1, 2]}}}, "sampling must be .* with a grid"),
        ({"limits": {"position_eror_rms": 1}}, "position_eror_rms is not a metric: did you mean position_error_rms"),
        ({"limits": {"position_error_rms": -1}}, "position_error_rms must be a finite number.*got -1"),
        ({"limits": [1]}, r"limits must be .*got \[1\]"),
        ({"set": {"vessel_sim.duration": 0.0}}, "must be above 0 s in a campaign"),
        ({"set": {"vessel_sim.duratoin": 1.0}}, "did you mean duration"),
        ({"draw": {"controller.vessel.surge_inertai": UNIT}}, "did you mean controller.vessel.surge_inertia"),
        ({"draw": {"controler.rate_hz": UNIT}}, "did you mean controller.rate_hz"),
        ({"draw": {"vessel.beem": UNIT}}, "vessel.beem is not a parameter"),
        ({"draw": {"controller.law": {"choice": ["guided"]}}}, "give several laws as `laws`"),
        ({"draw": {"vessel_sim.initial_pose[3]": UNIT}}, "has the elements 0 to 2"),
        ({"draw": {"controller.rate_hz[0]": UNIT}}, "is not a list"),
        ({"draw": {"vessel_sim.initial_pose": UNIT}}, "must be a choice .*as the parameter is a list of 3 finite numbers"),
        ({"draw": {LAG: {"uniform": [-2, -1]}}}, f"draw {LAG} must have values that are a finite number"),
        ({"draw": {LAG: {"normal": [-1000, 1]}}}, "must have values that are"),
        ({"draw": {LAG: {"choice": [1.0, -1.0]}}}, f"draw.{LAG} must be .*got -1.0"),
        ({"draw": {LAG: {"grid": [-1, 1, 3]}}}, f"draw.{LAG} must be .*got -1.0"),
        ({"draw": {"reference_ship.mode": {"choice": ["spirals"]}}}, "must be one of virtual_ship"),
        (
            {"draw": {FORCE: {"uniform": [0.8, 1.2], "relative": True}}},
            "the base value of relative must be a finite number, not 0 .got 0.0",
        ),
        ({"draw": {X: 3}}, f"draw {X}: distribution must be one of".replace("[", r"\[").replace("]", r"\]")),
    ],
)
def test_a_wrong_entry_is_one_line_that_names_it(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises((ParameterError, ScenarioError), match=message) as error:
        campaign(tmp_path, **changes)
    assert "\n" not in str(error.value)
    assert "small" in str(error.value) or "case9" in str(error.value)


@pytest.mark.parametrize("text", ["[", "3", "- scenario"])
def test_a_file_that_is_no_campaign_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "broken.yaml").write_text(text)
    with pytest.raises(ScenarioError, match="broken"):
        Campaign.load(tmp_path / "broken.yaml")
    with pytest.raises(ScenarioError, match=r"campaign file .*none\.yaml does not exist"):
        Campaign.load(tmp_path / "none.yaml")
    with pytest.raises(ScenarioError, match="campaign nothing is unknown"):
        Campaign.load("nothing")


def test_a_run_outside_of_the_campaign_is_refused(tmp_path: Path) -> None:
    with pytest.raises(VesselHsmcError, match=r"run must be 0 to 9 in the campaign small .got 10"):
        campaign(tmp_path).scenario(10)
