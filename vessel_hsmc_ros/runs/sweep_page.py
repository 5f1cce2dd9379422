"""The results of a sweep: table, CSV, JSON, picture, page."""

import csv
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.page_kit import Section, render_sections
from vessel_hsmc_ros.runs import sweep_figure
from vessel_hsmc_ros.runs.sweep import Axis, Outcome
from vessel_hsmc_ros.runs.sweep_figure import label, shown, text
from vessel_hsmc_ros.scenario.run_folder import provenance

FAILED = "failed"


def table(axes: Sequence[Axis], outcomes: Sequence[Outcome], metrics: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of all runs, with a column for the law if there are several."""
    laws = len({outcome.point.law for outcome in outcomes}) > 1
    head = [*(["law"] if laws else []), *(axis.parameter for axis in axes), *map(label, metrics)]
    lines = []
    for outcome in outcomes:
        cells = [text(metric, outcome.value(metric)) for metric in metrics] if not outcome.failure else [FAILED] * len(metrics)
        lines.append([*([outcome.point.law] if laws else []), *map(shown, outcome.point.values), *cells])
    return head, lines


def notes(axes: Sequence[Axis], outcomes: Sequence[Outcome]) -> list[str]:
    """One line on each run that failed."""
    names = [axis.parameter for axis in axes]
    found = []
    for outcome in outcomes:
        if outcome.failure:
            values = ", ".join(f"{name} = {shown(value)}" for name, value in zip(names, outcome.point.values, strict=True))
            law = f"{outcome.point.law}, " if outcome.point.law else ""
            found.append(f"{law}{values}: {outcome.failure}")
    return found


def write(folder: Path, axes: Sequence[Axis], outcomes: Sequence[Outcome], metrics: Sequence[str]) -> dict[str, Path]:
    """Write sweep.csv with all metrics, sweep.json, sweep.png and sweep.html; returns their paths by kind.

    Args:
        folder: An existing folder.
        axes: The swept parameters.
        outcomes: All runs.
        metrics: The metrics of the picture and of the table in the page.

    Raises:
        ReportError: a file cannot be written.
    """
    kinds = {"page": "html", "picture": "png", "csv": "csv", "json": "json"}
    files = {kind: folder / f"sweep.{suffix}" for kind, suffix in kinds.items()}
    try:
        write_csv(files["csv"], axes, outcomes)
        files["json"].write_text(json.dumps(_document(axes, outcomes), indent=2) + "\n", encoding="utf-8")
        sweep_figure.draw(files["picture"], axes, outcomes, metrics)
        files["page"].write_text(_page(files["picture"], axes, outcomes, metrics), encoding="utf-8")
    except OSError as error:
        raise ReportError(f"results in {folder} cannot be written: {error.strerror}") from None
    return files


def write_csv(path: Path, axes: Sequence[Axis], outcomes: Sequence[Outcome]) -> None:
    """Write a row for each run: law, values of the parameters, failure, and every metric, empty where there is none."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["law", *(axis.parameter for axis in axes), "failure", *Metrics._fields])
        for outcome in outcomes:
            metrics = [outcome.metrics.get(name) for name in Metrics._fields]
            writer.writerow([outcome.point.law, *outcome.point.values, outcome.failure, *metrics])


def _document(axes: Sequence[Axis], outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The content of sweep.json: provenance, parameters, runs."""
    runs = [
        {
            "changes": dict(outcome.point.changes),
            "failure": outcome.failure,
            # JSON has no infinity: a metric of a run that has nearly diverged may be one.
            "metrics": {k: v if v is not None and math.isfinite(v) else None for k, v in outcome.metrics.items()},
        }
        for outcome in outcomes
    ]
    scenario = outcomes[0].point.scenario
    return {**provenance(), "scenario": scenario, "parameters": {a.parameter: a.values for a in axes}, "runs": runs}


def _page(picture: Path, axes: Sequence[Axis], outcomes: Sequence[Outcome], metrics: Sequence[str]) -> str:
    """The page, with the picture in it."""
    head, lines = table(axes, outcomes, metrics)
    names = " and ".join(axis.parameter for axis in axes)
    changes = [outcome.point.changes for outcome in outcomes]
    common = [f"{name} = {value}" for name, value in changes[0].items() if all(other[name] == value for other in changes)]
    scenario = Path(outcomes[0].point.scenario).stem
    section = Section("Runs", "; ".join(common), picture.read_bytes(), head, lines)
    return render_sections(f"{scenario}: {names}", [f"{len(outcomes)} runs, offline"], [section], notes(axes, outcomes))
