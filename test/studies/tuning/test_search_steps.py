"""The search step by step, with runs that are a formula: batches, first trials, scales, pruned trials and progress."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.studies.batch import Outcome
from vessel_hsmc_ros.studies.tuning.plan import Case, Gain, Objective, Tuning
from vessel_hsmc_ros.studies.tuning.result import Search, Trial, open_study

POSITION, SPEED = "controller.guided.position_gain", "controller.guided.approach_speed"
GAINS = [Gain(POSITION, 0.05, 5.0, True), Gain(SPEED, 1.0, 3.0, False)]
SCENARIO = load_scenario("case2_tracking", {"controller.law": "guided", POSITION: 0.3, SPEED: 2.0, "vessel_sim.duration": 1.0})


@dataclass(frozen=True)
class Formula(Tuning):
    """A tuning whose error depends on the gains by a formula; counts its runs, and refuses gains below a bound."""

    runs: list[int] = field(default_factory=list)
    refused_below: float = 0.0

    def scenarios(self, gains: dict[str, float]) -> list[Scenario]:  # type: ignore[override]
        if gains[SPEED] < self.refused_below:
            raise ParameterError(f"{gains[SPEED]:g} is too slow")
        return super().scenarios(gains)

    def simulate(self, scenarios: Sequence[Scenario], on_run: Callable[[Outcome], None] | None = None) -> list[Outcome]:
        self.runs.append(len(scenarios))
        found = []
        for k, scenario in enumerate(scenarios):
            gain, speed = scenario.controller.guided.position_gain, scenario.controller.guided.approach_speed
            error = 2.0 + abs(math.log(gain)) + abs(speed - 2.5)
            metrics = Metrics(*[1.0] * 10)._replace(position_error_rms_last_quarter=error, yaw_moment_rms=10.0 * speed)
            found.append(Outcome(k, "", metrics))
            _ = on_run and on_run(found[-1])
        return found


def tuning(cases: int = 1, **values: object) -> Formula:
    given = {"objective": Objective(two=True), "gains": GAINS, "seed": 3, **values}
    return Formula([Case(f"{k}", SCENARIO) for k in range(cases)], **given)  # type: ignore[arg-type]


def searched(folder: Path, made: Formula, *counts: int, reports: list[float] | None = None) -> list[Trial]:
    """The trials of a search that is begun anew for each number of trials."""
    folder.mkdir(exist_ok=True)
    found: list[Trial] = []
    for count in counts:
        with open_study(folder, 1 + made.objective.two, made.definition()) as study:
            scales = made.evaluate(made.cases, {}).scales
            found = Search(study, made, scales).run(count, lambda done, _: reports.append(done) if reports is not None else None)
        assert len(found) == count
    return found


@pytest.mark.parametrize("cases", rest_long([1, 3]))
def test_a_search_in_any_parts_has_the_same_trials_and_as_many_as_it_is_given(tmp_path: Path, cases: int) -> None:
    whole = searched(tmp_path / "whole", tuning(cases), 14)
    assert searched(tmp_path / "parts", tuning(cases), 1, 7, 11) == whole[:11]
    assert [trial.number for trial in whole] == list(range(14))


def test_the_first_trial_has_the_present_gains_if_all_of_them_are_inside_their_ranges_or_at_an_end(tmp_path: Path) -> None:
    present = {POSITION: 0.3, SPEED: 2.0}
    ends = [[Gain(POSITION, 0.3, 5.0, True), GAINS[1]], [GAINS[0], Gain(SPEED, 1.0, 2.0, False)]]
    for number, gains in enumerate((GAINS, *ends)):
        assert searched(tmp_path / f"in{number}", tuning(gains=gains), 1)[0].gains == present
    outside = [[Gain(POSITION, 0.4, 5.0, True), GAINS[1]], [GAINS[0], Gain(SPEED, 1.0, 1.9, False)]]
    for number, gains in enumerate(outside):
        first = searched(tmp_path / f"out{number}", tuning(gains=gains), 1)[0].gains
        assert all(gain.low <= first[gain.parameter] <= gain.high for gain in gains)


def test_the_first_trials_spread_evenly_over_each_range_on_its_scale_and_depend_on_the_seed(tmp_path: Path) -> None:
    trials = searched(tmp_path / "one", tuning(), 10)[1:]
    for gain in GAINS:
        middle = math.sqrt(gain.low * gain.high) if gain.logarithmic else 0.5 * (gain.low + gain.high)
        below = sum(trial.gains[gain.parameter] < middle for trial in trials)
        assert 3 <= below <= 6
    assert len({trial.gains[POSITION] for trial in trials}) == 9
    others = searched(tmp_path / "other", tuning(seed=4), 10)[1:]
    assert not {trial.gains[POSITION] for trial in trials} & {trial.gains[POSITION] for trial in others}


def test_what_the_estimator_is_given_are_logarithms_of_cost_and_effort_in_this_order(tmp_path: Path) -> None:
    made = tuning()
    trials = searched(tmp_path / "s", made, 8)
    with open_study(tmp_path / "s", 2, made.definition()) as study:
        recorded = [each.values for each in study.get_trials()]
        distributions: dict[str, Any] = study.trials[0].distributions
        assert {name: each.log for name, each in distributions.items()} == {POSITION: True, SPEED: False}
    for trial, values in zip(trials, recorded, strict=True):
        assert trial.cost is not None
        assert values == pytest.approx([math.log(trial.cost.cost), math.log(trial.cost.effort)])
        assert trial.cost.effort == pytest.approx(trial.gains[SPEED] / 2.0)


def test_trials_whose_gains_are_refused_take_no_run_and_none_of_another(tmp_path: Path) -> None:
    made = tuning(cases=2, refused_below=2.0)
    trials = searched(tmp_path / "s", made, 12)
    pruned = [trial for trial in trials if trial.cost is None]
    assert 1 < len(pruned) < 11
    assert sum(made.runs[1:]) == 2 * (len(trials) - len(pruned))
    for trial in trials:
        assert (trial.cost is None) == (trial.gains[SPEED] < 2.0) == bool(trial.reason)
        if trial.cost is not None:
            assert trial.cost.effort == pytest.approx(trial.gains[SPEED] / 2.0)


def test_the_progress_counts_trials_in_fractions_of_their_runs(tmp_path: Path) -> None:
    reports: list[float] = []
    searched(tmp_path / "s", tuning(cases=2), 4, reports=reports)
    assert reports == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0, 2.0, 2.5, 3.0, 3.5, 4.0, 4.0])


def test_with_one_objective_the_effort_is_evaluated_and_does_not_guide_the_search(tmp_path: Path) -> None:
    made = replace(tuning(), objective=Objective())
    trials = searched(tmp_path / "s", made, 8)
    with open_study(tmp_path / "s", 1, made.definition()) as study:
        for trial, each in zip(trials, study.get_trials(), strict=True):
            assert trial.cost is not None
            assert each.values == pytest.approx([math.log(trial.cost.cost)])
            assert trial.cost.effort == pytest.approx(trial.gains[SPEED] / 2.0)
