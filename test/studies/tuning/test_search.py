"""The search: equal definitions give equal trials, whatever interrupts them."""

import multiprocessing
import os
import signal
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import ParameterError, RunError, ScenarioError
from vessel_hsmc_ros.simulation.compilation import DISABLED
from vessel_hsmc_ros.studies.tuning.plan import Gain, Objective, Tuning, held_out_cases, load_cases, parse_gains
from vessel_hsmc_ros.studies.tuning.result import Result, Trial, front_of, open_study, tune

SHORT = {"vessel_sim.duration": 1.0, "vessel_sim.sensors.position_noise": 0.1} | {
    f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")
}
GAINS = ("controller.guided.position_gain=0.5:5:log", "controller.guided.approach_speed=0.2:2")
STABLE = {"controller.hierarchical_printed.surge_reaching_gain": 10.0, "controller.hierarchical_printed.yaw_reaching_gain": 10.0}
"""Gains of the paper's law that are stable at 20 Hz."""

TRIALS = 14
"""More than those that do not depend on others."""


def tuning(gains: Sequence[str] = GAINS, law: str = "guided", seed: int = 1) -> Tuning:
    cases = load_cases("case2_tracking", SHORT | STABLE, law)
    return Tuning(cases, parse_gains(gains, law, cases[0].scenario), Objective(), seed)


def run(folder: Path, trials: int = TRIALS, planned: Tuning | None = None) -> Result:
    folder.mkdir(exist_ok=True)
    planned = planned or tuning()
    return tune(planned, folder, trials, planned.cases, lambda _number, _note: None)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Result:
    return run(tmp_path_factory.mktemp("uninterrupted"))


def test_the_first_trial_has_the_present_gains(uninterrupted: Result) -> None:
    first = uninterrupted.trials[0]
    assert first.gains == uninterrupted.tuning.present
    assert first.cost is not None
    assert first.cost.cost == pytest.approx(1.0)


def test_the_best_trial_is_no_worse_than_the_present_gains(uninterrupted: Result) -> None:
    assert uninterrupted.best.cost is not None
    assert uninterrupted.tuned.cost == uninterrupted.best.cost
    assert uninterrupted.tuned.cost.cost <= uninterrupted.present.cost.cost


def test_another_seed_gives_other_trials(tmp_path: Path, uninterrupted: Result) -> None:
    assert run(tmp_path, 3, tuning(seed=2)).trials[1:] != uninterrupted.trials[1:3]


def test_a_tuning_in_parts_has_the_same_trials(tmp_path: Path, uninterrupted: Result) -> None:
    for trials in (3, 10, TRIALS):
        done = run(tmp_path, trials)
        assert list(done.trials) == list(uninterrupted.trials[:trials])


def endless(folder: Path) -> None:
    """Tune until something kills this process."""
    run(folder, 10_000)


@pytest.mark.long
def test_a_killed_tuning_continues_with_the_same_trials(
    tmp_path: Path, uninterrupted: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(DISABLED, "1")  # a few dozen steps take less time than the import of a compiler by the process
    process = multiprocessing.get_context("spawn").Process(target=endless, args=(tmp_path,))
    process.start()
    journal, deadline = tmp_path / "journal.log", time.monotonic() + 120.0
    # Killed wherever it is after two trials, most probably in the middle of a simulation or of a line.
    while not (journal.exists() and journal.read_text().count('"result"') > 2):
        assert time.monotonic() < deadline
        assert process.is_alive()
        time.sleep(0.01)
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    process.join(30.0)
    with journal.open("a") as stream:  # half a line and a lock file, which a kill at another moment leaves
        stream.write('{"op_code":5,"work')
    (lock := tmp_path / "journal.log.lock").unlink(missing_ok=True)
    lock.symlink_to(journal)
    assert list(run(tmp_path).trials) == list(uninterrupted.trials)


@pytest.mark.parametrize("begun", rest_long([False, True]))
def test_a_trial_that_was_killed_while_it_was_proposed_is_proposed_again(
    tmp_path: Path, uninterrupted: Result, begun: bool
) -> None:
    planned = tuning()
    with open_study(tmp_path, 1, planned.definition()) as study:
        study.enqueue_trial(uninterrupted.trials[0].gains)
        if begun:
            study.ask()
    assert list(run(tmp_path).trials) == list(uninterrupted.trials)


def test_unstable_gains_are_pruned_with_their_reason(tmp_path: Path) -> None:
    planned = tuning(["controller.hierarchical_printed.yaw_reaching_gain=5:100"], "hierarchical_printed")
    trials = run(tmp_path, 8, planned).trials
    pruned = [trial for trial in trials if trial.cost is None]
    assert 0 < len(pruned) < len(trials)
    assert all("is unstable at" in trial.reason for trial in pruned)
    assert list(run(tmp_path, 8, planned).trials) == list(trials)


def test_without_a_completed_trial_the_reason_of_the_last_one_is_given() -> None:
    with pytest.raises(ParameterError, match="no trial of 1 has completed; the last one: unstable"):
        front_of([Trial(0, {}, reason="unstable")])


def test_a_journal_of_another_tuning_is_refused(tmp_path: Path) -> None:
    run(tmp_path, 1)
    with pytest.raises(ScenarioError, match=r"belongs to another tuning: seed = 1 there and = 2 here"):
        run(tmp_path, 1, tuning(seed=2))
    with pytest.raises(ScenarioError, match="other gains"):
        run(tmp_path, 1, tuning(GAINS[:1]))


def test_a_journal_of_the_same_runs_with_other_limits_is_refused(tmp_path: Path) -> None:
    """The limits are the scales of the cost: trials before and after would have costs of two scales."""
    planned = tuning()
    with open_study(tmp_path, 1, planned.definition()):
        pass
    for limits in ({"position_error_rms_last_quarter": 0.5}, {"position_error_rms_last_quarter": 0.25}):
        cases = [replace(case, limits=limits) for case in planned.cases]
        other = replace(planned, cases=cases).definition()
        with pytest.raises(ScenarioError, match="belongs to another tuning"), open_study(tmp_path, 1, other):
            pass
        (tmp_path / "journal.log").unlink()
        with open_study(tmp_path, 1, other):
            pass


@pytest.mark.parametrize("content", ["name: value\n", '{"a": 1}\n', '{"op_code": 4}\n', "{ not JSON\n{}\n"])
def test_a_file_that_is_not_a_journal_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "journal.log").write_text(content)
    with pytest.raises(ScenarioError, match="is not the journal of a tuning"):
        run(tmp_path, 1)


def test_two_processes_cannot_tune_in_one_folder(tmp_path: Path) -> None:
    with open_study(tmp_path, 1, tuning().definition()), pytest.raises(RunError, match="another process is tuning there"):
        run(tmp_path, 1)


def test_held_out_runs_have_other_noise_and_their_own_scales(uninterrupted: Result) -> None:
    (case,) = held_out_cases("case2_tracking", SHORT, "guided", others=False)
    assert case.scenario.vessel_sim.seed != uninterrupted.tuning.cases[0].scenario.vessel_sim.seed


def test_a_gain_at_the_edge_of_its_range_is_found(uninterrupted: Result) -> None:
    best = next(iter(uninterrupted.best.gains.items()))
    assert uninterrupted.at_edge(Gain(best[0], best[1], 10.0 * best[1], True))
    assert not uninterrupted.at_edge(Gain(best[0], 0.5 * best[1], 2.0 * best[1], True))
