"""A chunk of a campaign: its runs are simulated, evaluated and written as one Parquet file, the same bytes everywhere."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from vessel_hsmc_ros.campaign.dataset import write_table
from vessel_hsmc_ros.campaign.feasibility import infeasible
from vessel_hsmc_ros.campaign.plan import Campaign
from vessel_hsmc_ros.campaign.plan_file import Source
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.runs.batch import Outcome, simulate_many
from vessel_hsmc_ros.scenario.scenario import Scenario


@lru_cache(maxsize=4)
def campaign_of(source: Source, repetitions: int) -> Campaign:
    """The campaign of its texts; a process that computes many of its chunks makes it once."""
    return Campaign.parse(source, repetitions)


def run_chunk(campaign: Campaign, number: int, progress: Callable[[float], None] | None = None) -> bytes:
    """Compute a chunk of a campaign in this process.

    A run whose drawn values do not fit each other, which is unstable or which fails is a row, not an error.

    Args:
        campaign: The campaign.
        number: Number of the chunk, from 0.
        progress: Called with the completed fraction, from 0 to 1; may raise an exception to cancel the chunk.

    Returns:
        The content of its Parquet file.
    """
    runs = campaign.runs_of(number)
    made = {run: _scenario(campaign, run) for run in runs}
    valid = [(run, scenario) for run, scenario in made.items() if isinstance(scenario, Scenario)]
    outcomes: dict[int, Outcome] = {}

    def on_result(outcome: Outcome) -> None:
        outcomes[valid[outcome.index][0]] = outcome
        if progress is not None:
            progress(len(outcomes) / len(runs))

    simulate_many([scenario for _, scenario in valid], on_result=on_result)
    refused = {run: Outcome(0, error) for run, error in made.items() if isinstance(error, str)}
    every = outcomes | refused
    limits = {run: campaign.limits_of(scenario) for run, scenario in valid}
    rows = [_row(campaign, run, every[run], limits.get(run, {})) for run in runs]
    if campaign.has_ships:
        first = {campaign.planned(run).draw: scenario for run, scenario in reversed(valid)}  # its variants share the ship
        reasons = {draw: infeasible(scenario) for draw, scenario in first.items()}
        rows = [{**row, "infeasible": reasons.get(row["draw"], "")} for row in rows]
    return write_table(rows, campaign, number)


def exceeded(metrics: Metrics, limits: Mapping[str, float]) -> str:
    """The limits that a run exceeds, in one line; empty if there are none.

    Args:
        metrics: Of the run; one that it does not have, such as the settling time of an error that did not settle, is above
            every limit, and so is NaN.
        limits: Largest magnitudes by the names of metrics.
    """
    found = []
    for name, limit in limits.items():
        value = getattr(metrics, name)
        if value is None or not abs(value) <= limit:
            found.append(f"{name} = {'none' if value is None else f'{value:.6g}'} above {limit:g}")
    return "; ".join(found)


def _scenario(campaign: Campaign, run: int) -> Scenario | str:
    """The scenario of a run, or why its drawn values are not allowed."""
    try:
        return campaign.scenario(run)
    except (ParameterError, ScenarioError) as error:
        return str(error)


def _row(campaign: Campaign, run: int, outcome: Outcome, limits: Mapping[str, float]) -> dict[str, Any]:
    """The row of a run with its limits, by the names of the columns."""
    planned = campaign.planned(run)
    metrics = outcome.metrics
    failure = outcome.failure or (exceeded(metrics, limits) if metrics else "the run has no metrics")
    return {
        "run": run,
        "draw": planned.draw,
        "law": planned.law,
        campaign.variant_column: planned.variant,
        "seed": planned.seed,
        **planned.values,
        "failed": bool(failure),
        "failure": failure,
        "ended_early": bool(outcome.failure),
        **(metrics._asdict() if metrics else {}),
    }
