"""The summary of a run, run.json: where it comes from, how it ended, what was measured."""

import datetime
from collections.abc import Mapping
from typing import Any

from vessel_hsmc_ros.scenario.law_file import law_provenance
from vessel_hsmc_ros.scenario.run_folder import RunFolder, provenance
from vessel_hsmc_ros.scenario.scenario import Scenario


def origin_of(scenario: Scenario, mode: str, namespace: str) -> dict[str, Any]:
    """Provenance of a run, the first lines of its summary: code, machine, scenario, mode, time."""
    return {
        **provenance(),
        "scenario": scenario.name,
        "mode": mode,
        "namespace": namespace,
        "seed": scenario.vessel_sim.seed,
        **law_provenance(scenario.controller.law),
        "started": _now().isoformat(),
    }


def write_summary(
    folder: RunFolder, origin: Mapping[str, Any], exit_code: int, failure: str, measured: Mapping[str, Any]
) -> None:
    """Write run.json.

    Args:
        folder: The run folder.
        origin: Provenance of the run, with the time of its start.
        exit_code: As of the command.
        failure: What failed, in one line; empty if nothing did.
        measured: Metrics and further measured values.

    Raises:
        RunError: it cannot be written.
    """
    duration = (_now() - datetime.datetime.fromisoformat(origin["started"])).total_seconds()
    folder.write_summary({**origin, "duration": duration, "exit_code": exit_code, "failure": failure, **measured})


def _now() -> datetime.datetime:
    return datetime.datetime.now(tz=datetime.timezone.utc)
