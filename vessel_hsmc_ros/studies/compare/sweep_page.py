"""The results of a sweep: table, CSV, JSON, page, and the picture: metrics over one parameter as lines, over two as heat maps."""

import csv
import json
import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.diagrams import LIMIT, NEUTRAL, SERIES, figure, spans
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.report.tables import label, text
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.studies.compare.sweep import Axis, Outcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.ticker import Formatter

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

    Raises ReportError if a file cannot be written.
    """
    kinds = {"page": "html", "picture": "png", "csv": "csv", "json": "json"}
    files = {kind: folder / f"sweep.{suffix}" for kind, suffix in kinds.items()}
    with writing(f"results in {folder}"):
        write_csv(files["csv"], axes, outcomes)
        files["json"].write_text(json.dumps(_document(axes, outcomes), indent=2) + "\n", encoding="utf-8")
        draw(files["picture"], axes, outcomes, metrics)
        files["page"].write_text(_page(files["picture"], axes, outcomes, metrics), encoding="utf-8")
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


Array = NDArray[Any]

MAX_TICKS = 8  # largest number of cells in a row of a heat map that have their value written into them


def shown(value: object) -> str:
    """A value of a parameter as text."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def draw(path: Path, axes: Sequence[Axis], outcomes: Sequence[Outcome], metrics: Sequence[str]) -> None:
    """Draw the metrics of all runs.

    `axes`: the swept parameters, one or two. `metrics`: the metrics to draw; with two parameters each law has a row of heat
    maps.
    """
    laws = list(dict.fromkeys(outcome.point.law for outcome in outcomes))
    rows, columns = (len(metrics), 1) if len(axes) == 1 else (len(laws), len(metrics))
    size = (8.0, 3.0 * rows + 0.6) if len(axes) == 1 else (5.2 * columns + 0.6, 4.2 * rows)
    with figure(path, *size) as picture:
        panels = picture.subplots(rows, columns, squeeze=False)
        if len(axes) == 1:
            for panel, metric in zip(panels[:, 0], metrics, strict=True):
                _lines(panel, axes[0], outcomes, metric, laws)
        else:
            for i, law in enumerate(laws):
                of_law = [outcome for outcome in outcomes if outcome.point.law == law]
                for panel, metric in zip(panels[i], metrics, strict=True):
                    _heat_map(panel, axes, of_law, metric, law)


def _lines(panel: "Axes", axis: Axis, outcomes: Sequence[Outcome], metric: str, laws: Sequence[str]) -> None:
    """A metric over one parameter, a line for each law; a cross at the top marks a run that failed."""
    positions = _positions(axis)
    all_values = np.array([outcome.value(metric) for outcome in outcomes])
    if spans(all_values):
        panel.set_yscale("log")
    for i, law in enumerate(laws):
        of_law = [outcome for outcome in outcomes if outcome.point.law == law]
        colour = SERIES[i % len(SERIES)]
        panel.plot(positions, [outcome.value(metric) for outcome in of_law], "o-", color=colour, ms=4, lw=1.2, label=law)
        failed = [x for x, outcome in zip(positions, of_law, strict=True) if outcome.failure]
        if failed:  # marked at the top edge, whatever the scale: there is no value to draw them at
            look: Any = {"color": colour if len(laws) > 1 else LIMIT, "ms": 8, "mew": 2, "label": f"{law} failed".strip()}
            panel.plot(failed, [0.96] * len(failed), "x", transform=panel.get_xaxis_transform(), **look)
    _label_axis(panel.xaxis, panel.set_xscale, axis)
    panel.yaxis.set_major_formatter(_formatter(metric))
    panel.set(xlabel=axis.parameter, ylabel="\n".join(textwrap.wrap(label(metric), 24)))
    if len(laws) > 1 or any(outcome.failure for outcome in outcomes):
        panel.legend(loc="best")


def _heat_map(panel: "Axes", axes: Sequence[Axis], outcomes: Sequence[Outcome], metric: str, law: str) -> None:
    """A metric over two parameters; a cross marks a run that failed."""
    from matplotlib.colors import LogNorm

    shape = len(axes[0].values), len(axes[1].values)
    values = np.array([outcome.value(metric) for outcome in outcomes]).reshape(shape)
    failed = np.array([bool(outcome.failure) for outcome in outcomes]).reshape(shape)
    # In cells of equal size, whatever the spacing of the values.
    norm = LogNorm() if spans(values) else None
    image = panel.imshow(np.ma.masked_invalid(values), origin="lower", aspect="auto", cmap="viridis_r", norm=norm)
    panel.set_facecolor("#e3e6e9")
    panel.grid(visible=False)
    for row, column in zip(*np.nonzero(failed), strict=True):
        panel.plot(column, row, "x", color=LIMIT, ms=8, mew=2)
    if max(shape) <= MAX_TICKS:
        for (row, column), value in np.ndenumerate(values):
            if not failed[row, column]:
                panel.text(column, row, text(metric, value), ha="center", va="center", fontsize=7, bbox=_PLATE)
    for scale, axis in ((panel.yaxis, axes[0]), (panel.xaxis, axes[1])):
        every = max(1, -(-len(axis.values) // MAX_TICKS))
        ticks = range(0, len(axis.values), every)
        scale.set_ticks(list(ticks), [shown(axis.values[i]) for i in ticks])
    panel.set(xlabel=axes[1].parameter, ylabel=axes[0].parameter, title=": ".join(filter(None, (law, label(metric)))))
    if np.isfinite(values).any():
        panel.figure.colorbar(image, ax=panel, format=_formatter(metric))


_PLATE = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": NEUTRAL, "lw": 0.3, "alpha": 0.8}


def _formatter(metric: str) -> "Formatter":
    from matplotlib.ticker import FuncFormatter

    return FuncFormatter(lambda value, _: text(metric, value))


def _positions(axis: Axis) -> Array:
    """The values of a numeric parameter; the numbers from 0 for one of texts or lists."""
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in axis.values)
    return np.array(axis.values, float) if numeric else np.arange(float(len(axis.values)))


def _label_axis(scale: Any, set_scale: Any, axis: Axis) -> None:
    """Choose a logarithmic scale for widely spaced numbers, and name the values that are not numbers."""
    positions = _positions(axis)
    if any(not isinstance(value, int | float) or isinstance(value, bool) for value in axis.values):
        scale.set_ticks(positions, [shown(value) for value in axis.values])
    elif spans(positions):
        set_scale("log")
