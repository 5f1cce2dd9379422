"""The files and sentences of a tuning from a result whose every number is unlike the others, and what defines a tuning."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.tables import text
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.batch import Outcome
from vessel_hsmc_ros.studies.tuning import files
from vessel_hsmc_ros.studies.tuning.plan import PENALTY, Case, Cost, Evaluation, Gain, Objective, Tuning, load_cases
from vessel_hsmc_ros.studies.tuning.result import Result, Trial, best_of, front_of, verdict

LAW = "los_pid"
FIRST, SECOND = f"controller.{LAW}.surge_gain", f"controller.{LAW}.yaw_damping"
GAINS = [Gain(FIRST, 0.1, 0.9, False, unit="1/s"), Gain(SECOND, 1.0, 100.0, True)]
SCENARIO = load_scenario("case2_tracking", {"controller.law": LAW, FIRST: 0.3, SECOND: 7.0, "vessel_sim.duration": 1.0})
CASES = [Case("calm", SCENARIO), Case("windy", SCENARIO, {"position_error_rms": 4.0})]
OBJECTIVE = Objective("position_error_rms", "surge_force_rms", two=True)
TRIALS = [
    Trial(0, {FIRST: 0.3, SECOND: 7.0}, Cost(1.0, 1.5, 0)),
    Trial(1, {SECOND: 20.0, FIRST: 0.5}, Cost(0.25, 2.5, 1)),  # in another order
    Trial(2, {FIRST: 0.7, SECOND: 30.0}, reason="they do not fit"),
    Trial(3, {FIRST: 0.6, SECOND: 99.0}, Cost(0.5, 1.25, 0)),
    Trial(4, {FIRST: 0.2, SECOND: 40.0}, Cost(0.75, 2.25, 0)),
]


def evaluation(metric: list[float], cost: Cost) -> Evaluation:
    values = np.column_stack([metric, [50.0 + k for k in range(len(metric))]])
    return Evaluation(values, np.full_like(values, 2.0), tuple("it failed" if np.isnan(m) else "" for m in metric), cost)


RESULT = Result(
    Tuning(CASES, GAINS, OBJECTIVE, seed=5),
    TRIALS,
    TRIALS[3],
    front_of(TRIALS),
    evaluation([1.5, 2.5], Cost(1.0, 1.5, 0)),
    evaluation([0.5, 0.75], Cost(0.5, 1.25, 0)),
    [Case("unseen", SCENARIO)],
    evaluation([9.5], Cost(1.125, 1.0, 0)),
    evaluation([np.nan], Cost(2.25, 1.75, 1)),
)


def test_the_table_of_trials_has_every_gain_in_its_own_column(tmp_path: Path) -> None:
    files.write_trials(tmp_path / "trials.csv", RESULT)
    with (tmp_path / "trials.csv").open() as stream:
        rows = list(csv.reader(stream))
    assert rows == [
        ["trial", FIRST, SECOND, "cost", "effort", "failed_runs", "front", "reason"],
        ["0", "0.3", "7.0", "1.0", "1.5", "0", "0", ""],
        ["1", "0.5", "20.0", "0.25", "2.5", "1", "1", ""],
        ["2", "0.7", "30.0", "", "", "", "0", "they do not fit"],
        ["3", "0.6", "99.0", "0.5", "1.25", "0", "1", ""],
        ["4", "0.2", "40.0", "0.75", "2.25", "0", "0", ""],
    ]


def test_the_summary_has_both_sets_of_gains_on_both_lists_of_runs() -> None:
    found = json.loads(json.dumps(files.summary(RESULT)))
    assert (found["trials"], found["pruned"], found["front"]) == (5, 1, [1, 3])
    assert found["gains"] == {"present": {FIRST: 0.3, SECOND: 7.0}, "tuned": {FIRST: 0.6, SECOND: 99.0}}
    assert found["cases"] == {
        "present": {"cost": 1.0, "effort": 1.5, "failed": 0},
        "tuned": {"cost": 0.5, "effort": 1.25, "failed": 0},
        "runs": [{"case": "calm", "present": 1.5, "tuned": 0.5}, {"case": "windy", "present": 2.5, "tuned": 0.75}],
    }
    assert found["held_out"] == {
        "present": {"cost": 1.125, "effort": 1.0, "failed": 0},
        "tuned": {"cost": 2.25, "effort": 1.75, "failed": 1},
        "runs": [{"case": "unseen", "present": 9.5, "tuned": None}],
    }


def test_the_file_of_the_gains_states_what_they_are_worth() -> None:
    written = files.gains_file(RESULT)
    assert "trial 3 of 5, cost 0.5 against 1 before" in written
    content = yaml.safe_load(written)["/**/controller"]["ros__parameters"]
    assert content == {"law": LAW, LAW: {"surge_gain": 0.6, "yaw_damping": 99.0}}


def test_the_tables_of_the_page_have_every_value_in_its_own_place() -> None:
    assert files.gains_table(RESULT) == [
        [f"{LAW}.surge_gain", "0.3 1/s", "0.6 1/s", "0.1 to 0.9", ""],
        [f"{LAW}.yaw_damping", "7", "99", "1 to 100", "at the edge"],
    ]
    front = files._front(RESULT)
    assert ([*front.head][:3], [line[:3] for line in front.lines]) == (
        ["trial", "cost", "effort"],
        [["1", "0.25", "2.5"], ["3", "0.5", "1.25"]],
    )
    assert front.marked == ["3"]
    seen = files._cases("x", RESULT, CASES, RESULT.present, RESULT.tuned)
    assert [[*line] for line in seen.lines] == [
        ["calm", text("position_error_rms", np.nan), "1.5 m", "0.5 m", "0.333"],
        ["windy", "4 m", "2.5 m", "0.75 m", "0.3"],
    ]
    unseen = files._cases("x", RESULT, RESULT.held_out, RESULT.held_out_present, RESULT.held_out_tuned)
    assert [[*line][2:] for line in unseen.lines] == [["9.5 m", "failed", ""]]
    assert files._pruned(RESULT).startswith("1 trials were pruned")


def test_the_verdict_names_each_cost_and_every_reservation() -> None:
    assert verdict(RESULT) == [
        "On the runs of the tuning the cost falls, from 1 to 0.5 (factor 0.5); position error, rms with the approach: 2 m before,"
        " 0.625 m after in the mean.",
        "On the held-out runs the cost rises, from 1.125 to 2.25 (factor 2).",
        "The gains are overfitted to the runs of the tuning.",
        "The tuned gains are the best of those without more effort than the present ones; the smallest cost is 0.25, with an"
        " effort of 2.5: trial 1 in the table of the front.",
        "With the tuned gains 1 run fails.",
        "At the edge of its range: yaw_damping. A wider range may give a smaller cost.",
    ]
    floored = replace(RESULT, tuned=RESULT.tuned._replace(scales=RESULT.tuned.scales * 1e3))
    assert verdict(floored)[0].startswith("On the runs of the tuning the cost falls, from 1 to 0.5, its floor (factor 0.5);")
    better = replace(RESULT, held_out_tuned=evaluation([0.25], Cost(0.75, 1.0, 0)), best=TRIALS[1])
    assert verdict(better)[1:] == [
        "On the held-out runs the cost falls, from 1.125 to 0.75 (factor 0.667); position error, rms with the approach: 9.5 m"
        " before, 0.25 m after."
    ]


def test_of_the_front_the_best_has_no_more_effort_than_the_present_gains() -> None:
    front = front_of(TRIALS)
    assert [trial.number for trial in front] == [1, 3]
    assert best_of(front, Cost(9.0, 1.25, 0), two=True).number == 3
    assert best_of(front, Cost(9.0, 1.25, 0), two=False).number == 1
    assert best_of(front, Cost(9.0, 0.5, 0), two=True).number == 1


def definition(**changes: Any) -> dict[str, Any]:
    return replace(RESULT.tuning, **changes).definition()


def test_whatever_changes_the_trials_defines_the_tuning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vessel_hsmc_ros.studies.tuning.plan.dump_scenario", lambda scenario: str(scenario.vessel_sim))
    same = definition()
    assert same == definition(workers=3)
    other: dict[str, dict[str, Any]] = {
        "seed": {"seed": 6},
        "cases": {"cases": [CASES[0], replace(CASES[1], limits={"position_error_rms": 5.0})]},
        "runs": {"cases": CASES[:1]},
        "aggregate": {"objective": replace(OBJECTIVE, aggregate="worst")},
        "effort": {"objective": replace(OBJECTIVE, second="yaw_moment_rms")},
        "objectives": {"objective": replace(OBJECTIVE, two=False)},
        "gains": {"gains": [GAINS[0], GAINS[1]._replace(high=50.0)]},
    }
    for name, changes in other.items():
        assert definition(**changes)[name] != same[name], name
    for changed in ({"high": 0.8}, {"low": 0.2}, {"logarithmic": True}):
        assert definition(gains=[GAINS[0]._replace(**changed), GAINS[1]]) != same


def test_the_scale_of_each_metric_is_its_limit_or_the_value_of_its_own_run() -> None:
    present = np.array([[1.5, 20.0], [2.5, np.nan], [0.0, 40.0]])
    cases = [*CASES, Case("third", SCENARIO, {"surge_force_rms": 8.0})]
    assert OBJECTIVE.scales(cases, present).tolist() == [[1.5, 20.0], [4.0, 1.0], [1.0, 8.0]]


def test_a_run_that_lacks_a_value_counts_for_its_own_metric_alone() -> None:
    values, scales = np.array([[2.0, 3.0], [np.nan, 12.0]]), np.array([[4.0, 1.0], [1.0, 4.0]])
    found = replace(OBJECTIVE, aggregate="worst").cost(values, scales)
    assert found == pytest.approx((PENALTY * (1.0 + PENALTY / 2.0), 3.0, 1))
    metrics = Metrics(*[None] * len(Metrics._fields))._replace(surge_force_rms=-3.0)  # type: ignore[arg-type]
    outcomes = [Outcome(0, "", metrics), Outcome(1, "it failed", metrics)]
    np.testing.assert_array_equal(OBJECTIVE.values(outcomes), [[np.nan, 3.0], [np.nan, np.nan]])


def test_a_whole_gain_is_the_nearest_one_of_its_range() -> None:
    whole = Gain("x", 1, 11, False, whole=True)
    assert [whole.at(share) for share in (0.0, 0.14, 0.16, 0.99, 1.0)] == [1, 2, 3, 11, 11]
    assert Gain("x", 1.0, 100.0, True).at(0.5) == pytest.approx(10.0)


def test_every_draw_of_a_campaign_and_every_row_of_a_suite_is_a_case_with_the_changes(tmp_path: Path) -> None:
    (tmp_path / "draws.yaml").write_text(
        "scenario: case2_tracking\nlaws: [guided, los_pid]\nruns: 3\nlimits: {position_error_rms: 5.0}\n"
        "draw:\n  vessel_sim.sensors.position_noise: {uniform: [0.1, 0.2]}\n"
    )
    (tmp_path / "rows.yaml").write_text(
        "rows:\n  - {name: one, set: {vessel_sim.duration: 3.0}, at_most: 2.0}\n  - {name: two, largest: 3.0}\n"
    )
    changes = {"vessel_sim.duration": 7.0}
    for name, names in (("draws.yaml", ["draw 0", "draw 1", "draw 2"]), ("rows.yaml", ["one", "two"])):
        cases = load_cases(str(tmp_path / name), changes, "los_pid")
        assert [case.name for case in cases] == names
        assert {case.scenario.vessel_sim.duration for case in cases} == {7.0}
        assert {case.scenario.controller.law for case in cases} == {"los_pid"}
    assert [len(case.limits) for case in cases] == [1, 1]
    noises = {case.scenario.vessel_sim.sensors.position_noise for case in load_cases(str(tmp_path / "draws.yaml"), {})}
    assert len(noises) == 3
    (tmp_path / "alone.yaml").write_text((tmp_path / "draws.yaml").read_text().replace("laws: [guided, los_pid]\n", ""))
    assert [case.name for case in load_cases(str(tmp_path / "alone.yaml"), {})] == ["draw 0", "draw 1", "draw 2"]


@pytest.mark.parametrize(("before", "overfitted"), [(0.9, True), (1.01, True), (1.03, False)])
def test_gains_that_hardly_help_unseen_runs_are_overfitted(before: float, overfitted: bool) -> None:
    unseen = replace(
        RESULT,
        held_out_present=evaluation([9.5], Cost(before, 1.0, 0)),
        held_out_tuned=evaluation([9.0], Cost(1.0, 1.0, 0)),
    )
    assert ("The gains are overfitted to the runs of the tuning." in verdict(unseen)) is overfitted
