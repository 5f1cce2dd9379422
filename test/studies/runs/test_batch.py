"""Many runs in one call: threads, lazily made scenarios, errors."""

from collections.abc import Iterator

import pytest

from vessel_hsmc_ros import load_scenario
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.studies.batch import AHEAD, Outcome, simulate_many, stream


def scenarios(count: int, **changes: object) -> list[Scenario]:
    """Short runs with noise of their own."""
    noise = {"vessel_sim.duration": 0.5, "vessel_sim.sensors.position_noise": 0.1, "controller.law": "guided"}
    return [load_scenario("case2_tracking", {**noise, "vessel_sim.seed": seed, **changes}) for seed in range(count)]


def test_threads_give_the_outcomes_of_one_run_after_the_other() -> None:
    runs = scenarios(6)
    assert simulate_many(runs, workers=2) == simulate_many(runs)


def test_scenarios_are_made_when_their_turn_comes() -> None:
    runs, made, ahead = scenarios(20), 0, []

    def lazily() -> Iterator[Scenario]:
        nonlocal made
        for run in runs:
            made += 1
            yield run

    def note(outcome: Outcome) -> None:
        ahead.append(made - len(ahead))

    outcomes = simulate_many(lazily(), workers=2, on_result=note)
    assert [outcome.index for outcome in outcomes] == list(range(20))
    assert max(ahead) <= 2 * AHEAD


def test_without_scenarios_there_are_no_outcomes() -> None:
    assert simulate_many(iter(())) == []


@pytest.mark.long
@pytest.mark.parametrize("threads", [True, False])
def test_an_error_of_a_stream_cancels_the_tasks_that_wait(threads: bool) -> None:
    with pytest.raises(ZeroDivisionError):
        stream(inverse, iter([1.0, 0.0, *[2.0] * 100]), workers=2, threads=threads, on_result=lambda _: None)


def inverse(task: float, progress: object) -> float:
    return 1.0 / task
