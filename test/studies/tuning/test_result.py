"""What a tuning states of its best gains."""

from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.studies.batch import Outcome
from vessel_hsmc_ros.studies.tuning.files import MAX_LISTED_RUNS, _cases, summary
from vessel_hsmc_ros.studies.tuning.plan import (
    Case,
    Cost,
    Evaluation,
    Gain,
    Objective,
    Tuning,
    chosen_objective,
    load_cases,
    parse_gains,
)
from vessel_hsmc_ros.studies.tuning.result import Result, Trial, _repair, front_of, tune


class Formula(Tuning):
    """A tuning whose runs are replaced by a formula: the error grows with the duration and with the distance of the gain."""

    def simulate(self, scenarios: Sequence[Scenario], on_run: Callable[[Outcome], None] | None = None) -> list[Outcome]:
        found = []
        for k, scenario in enumerate(scenarios):
            size = scenario.vessel_sim.duration
            error = size * (1.0 + abs(scenario.controller.guided.position_gain - 0.2))
            metrics = Metrics(*[1.0] * 10)._replace(position_error_rms_last_quarter=error, yaw_moment_rms=size)
            found.append(Outcome(k, "", metrics))
        for outcome in found:
            _ = on_run and on_run(outcome)
        return found


def test_held_out_runs_of_another_size_are_relative_to_their_own(tmp_path: Path) -> None:
    cases = [
        Case(str(size), load_scenario("case2_tracking", {"controller.law": "guided", "vessel_sim.duration": size}))
        for size in (1.0, 500.0)
    ]
    gains = parse_gains(["controller.guided.position_gain=0.05:0.5"], "guided", cases[0].scenario)
    result = tune(Formula(cases[:1], gains, Objective()), tmp_path, 4, cases[1:], lambda _number, _note: None)
    assert result.held_out_present.cost == pytest.approx((1.0, 1.0, 0))
    assert result.held_out_tuned.cost == pytest.approx(result.tuned.cost)
    assert result.tuned.cost.cost < 0.99
    sides = summary(result)
    assert [[row["case"] for row in sides[side]["runs"]] for side in ("cases", "held_out")] == [["1.0"], ["500.0"]]


def test_of_many_runs_those_that_have_become_worst_are_listed() -> None:
    scenario = load_scenario("case2_tracking", {"controller.law": "guided", "vessel_sim.duration": 1.0})
    cases = [Case(f"run {k}", scenario) for k in range(MAX_LISTED_RUNS + 3)]
    count = len(cases)
    tuned = np.column_stack([np.roll(np.arange(1.0, count + 1.0), 20), np.ones(count)])
    sides = [Evaluation(values, np.ones((count, 2)), ("",) * count, Cost(1.0, 1.0, 0)) for values in (np.ones((count, 2)), tuned)]
    tuning = SimpleNamespace(objective=Objective())
    section = _cases("runs", SimpleNamespace(tuning=tuning), cases, *sides)  # type: ignore[arg-type]
    ratios = [float(line[-1]) for line in section.lines]
    assert ratios == sorted(range(4, count + 1), reverse=True)


@pytest.mark.parametrize(
    ("logarithmic", "value", "at_edge"),
    [
        (True, 0.01, True),
        (True, 0.0101, True),
        (True, 0.1, False),  # a quarter of the logarithmic range, a hundredth of the linear one
        (True, 99.0, True),
        (False, 0.1, True),
        (False, 50.0, False),
        (False, 99.0, True),
    ],
)
def test_a_gain_is_at_an_edge_of_its_range_on_the_scale_of_the_search(logarithmic: bool, value: float, at_edge: bool) -> None:
    gain = Gain("controller.law.gain", 0.01, 100.0, logarithmic)
    nothing: Any = None
    best = Trial(1, {gain.parameter: value})
    result = Result(nothing, [best], best, [best], nothing, nothing, [], nothing, nothing)
    assert result.at_edge(gain) is at_edge


def test_a_trial_that_another_one_equals_in_effort_and_beats_in_cost_is_not_on_the_front() -> None:
    costs = [(3.0, 1.0), (2.0, 1.0), (1.0, 2.0), (1.5, 2.0)]
    front = front_of([Trial(k, {}, Cost(*each, 0)) for k, each in enumerate(costs)])
    assert [trial.number for trial in front] == [2, 1]


def test_of_two_trials_of_one_cost_the_one_with_more_effort_is_not_on_the_front() -> None:
    trials = [Trial(0, {}, Cost(1.0, 3.0, 0)), Trial(1, {}, Cost(1.0, 2.0, 0)), Trial(2, {}, Cost(2.0, 1.0, 0))]
    assert [trial.number for trial in front_of(trials)] == [1, 2]


def test_what_a_killed_process_leaves_is_repaired_and_a_whole_journal_stays_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "journal.log"
    lock = tmp_path / "journal.log.lock"
    for content, expected in ((b'{"a": 1}\n{"b": 2}\n', b'{"a": 1}\n{"b": 2}\n'), (b'{"a": 1}\n{"b"', b'{"a": 1}\n'), (b"", b"")):
        path.write_bytes(content)
        lock.symlink_to(path)
        _repair(path)
        assert path.read_bytes() == expected
        assert not lock.is_symlink()
    path.unlink()
    _repair(path)
    assert not path.exists()


def test_the_effort_is_by_default_another_metric_than_the_cost() -> None:
    assert chosen_objective("position_error_rms").second == "yaw_moment_rms"
    assert chosen_objective("yaw_moment_rms").second == "surge_force_rms"
    assert not chosen_objective("yaw_moment_rms").two


def test_the_law_that_is_chosen_takes_precedence_over_that_of_changes() -> None:
    (case,) = load_cases("case2_tracking", {"controller.law": "pd"}, "los_pid")
    assert case.scenario.controller.law == "los_pid"
    (case,) = load_cases("case2_tracking", {"controller.law": "pd"})
    assert case.scenario.controller.law == "pd"
