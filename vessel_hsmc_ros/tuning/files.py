"""The files of a tuning: the best gains as a ROS parameters file, all trials as CSV, the summary as JSON."""

import csv
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.scenario.parameters_file import dump_parameters
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.tuning import figures, page
from vessel_hsmc_ros.tuning.cases import LAW
from vessel_hsmc_ros.tuning.gains import NODE
from vessel_hsmc_ros.tuning.plan import Evaluation
from vessel_hsmc_ros.tuning.result import Result

BEST = "best.yaml"


def write(folder: Path, result: Result) -> dict[str, Path]:
    """Write best.yaml, trials.csv, tune.json, two pictures and the page; returns their paths by kind.

    Args:
        folder: An existing folder.
        result: The result.

    Raises:
        ReportError: a file cannot be written.
    """
    names = {
        "gains": BEST,
        "page": "tune.html",
        "front": "front.png",
        "search": "search.png",
        "trials": "trials.csv",
        "summary": "tune.json",
    }
    files = {kind: folder / name for kind, name in names.items()}
    try:
        files["gains"].write_text(gains_file(result), encoding="utf-8")
        write_trials(files["trials"], result)
        files["summary"].write_text(json.dumps(summary(result), indent=2) + "\n", encoding="utf-8")
        figures.draw_front(files["front"], result)
        figures.draw_search(files["search"], result)
        files["page"].write_text(page.render(result, [files["front"], files["search"]]), encoding="utf-8")
    except OSError as error:
        raise ReportError(f"results in {folder} cannot be written: {error.strerror}") from None
    return files


def gains_file(result: Result) -> str:
    """The tuned gains and their law as a ROS parameters file."""
    gains = {name.removeprefix(NODE): value for name, value in result.best.gains.items()}
    values = {LAW.removeprefix(NODE): result.tuning.law, **gains}
    head = (
        f"# Gains of {result.tuning.law}, tuned by vessel-hsmc {provenance()['version']}: trial {result.best.number} of"
        f" {len(result.trials)}, cost {result.tuned.cost.cost:.4g} against {result.present.cost.cost:.4g} before.\n"
        f"# vessel-hsmc run SCENARIO --set @{BEST}; for the node, a further --params-file after that of the scenario.\n"
    )
    return head + dump_parameters({NODE.removesuffix("."): values})


def write_trials(path: Path, result: Result) -> None:
    """Write a row for each trial: gains, cost, effort, failed runs, the reason why it was pruned, whether it is on the front."""
    names = [gain.parameter for gain in result.tuning.gains]
    front = {trial.number for trial in result.front}
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["trial", *names, "cost", "effort", "failed_runs", "front", "reason"])
        for trial in result.trials:
            cost: Sequence[object] = trial.cost or ("", "", "")
            gains = [trial.gains[name] for name in names]
            writer.writerow([trial.number, *gains, *cost, int(trial.number in front), trial.reason])


def summary(result: Result) -> dict[str, Any]:
    """The content of tune.json."""
    tuning = result.tuning
    return {
        **provenance(),
        "definition": tuning.definition(),
        "trials": len(result.trials),
        "pruned": sum(trial.cost is None for trial in result.trials),
        "gains": {"present": tuning.present, "tuned": result.best.gains},
        "front": [trial.number for trial in result.front],
        "cases": _evaluations([case.name for case in tuning.cases], result.present, result.tuned),
        "held_out": _evaluations([case.name for case in result.held_out], result.held_out_present, result.held_out_tuned),
    }


def _evaluations(names: Sequence[str], present: Evaluation, tuned: Evaluation) -> dict[str, Any]:
    """Costs of both sets of gains, and the metric of every case."""
    sides = {"present": present, "tuned": tuned}
    costs = {side: each.cost._asdict() for side, each in sides.items()}
    rows = [
        {"case": name, **{side: _finite(float(each.values[i, 0])) for side, each in sides.items()}}
        for i, name in enumerate(names)
    ]
    return {**costs, "runs": rows}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None  # JSON has no NaN
