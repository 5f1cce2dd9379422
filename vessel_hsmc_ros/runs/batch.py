"""Many runs in one call: their metrics always, their trajectories where they are asked for."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from vessel_hsmc_ros.core.exceptions import ControlError, SimulationError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.scenario import Scenario


@dataclass(frozen=True)
class Outcome:
    """The result of one run.

    Attributes:
        index: Number of the run among those of the call.
        failure: Why it ended early, in one line; empty if it did not.
        metrics: None for a run that ended early.
        run: Its arrays, where they were asked for; None for a run that ended early.
    """

    index: int
    failure: str = ""
    metrics: Metrics | None = None
    run: Run | None = None


def simulate_many(
    scenarios: Sequence[Scenario],
    *,
    keep: Collection[int] = (),
    workers: int | None = 1,
    on_result: Callable[[Outcome], None] | None = None,
) -> list[Outcome]:
    """Simulate and evaluate scenarios; a run that is unstable or fails is an outcome, not an error.

    Args:
        scenarios: One for each run, with its own seed.
        keep: Numbers of the runs whose arrays are kept.
        workers: Number of processes; None for one per core.
        on_result: Called with each outcome as soon as it is known.

    Returns:
        The outcomes in the order of the scenarios.
    """
    del workers
    outcomes = []
    for index, scenario in enumerate(scenarios):
        outcomes.append(simulate_one(scenario, index, index in keep))
        if on_result is not None:
            on_result(outcomes[-1])
    return outcomes


def simulate_one(scenario: Scenario, index: int = 0, keep: bool = False) -> Outcome:
    """Simulate and evaluate one scenario; see `simulate_many`."""
    try:
        run = simulate(scenario)
    except (ControlError, SimulationError) as error:
        return Outcome(index, str(error))
    return Outcome(index, metrics=measured(run, scenario), run=run if keep else None)
