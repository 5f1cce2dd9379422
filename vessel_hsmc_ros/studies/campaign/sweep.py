"""A sweep: one scenario simulated for each value of a parameter, or for each pair of values of two; its files and its picture."""

import csv
import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import yaml

from vessel_hsmc_ros.core.exceptions import InstabilityError, ParameterError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.diagrams import LIMIT, SERIES, figure, spans
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.report.tables import label, text
from vessel_hsmc_ros.scenario.ros_yaml import read_yaml
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compile import ensure_compiled
from vessel_hsmc_ros.studies.campaign.plan import LAW
from vessel_hsmc_ros.studies.runs import batch

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_SWEEP_POINTS = 100_000  # largest number of values of an axis
MAX_TICKS = 8  # largest number of named cells along a side of a heat map
FORM = "node.param=start:stop:count, start:stop:count:log or a list such as 0.1,0.2,0.5"
FAILED = "failed"


class Axis(NamedTuple):
    """A swept parameter, as `node.parameter`, and its values."""

    parameter: str
    values: tuple[Any, ...]

    @property
    def numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.values)


class Point(NamedTuple):
    """One run of a sweep."""

    scenario: str
    values: tuple[Any, ...]  # its values of the swept parameters
    changes: Mapping[str, object]  # all changes to the scenario by `node.parameter`
    law: str = ""  # the law that the sweep sets; empty where the scenario selects it


@dataclass(frozen=True)
class Outcome:
    """The result of one run."""

    point: Point
    failure: str = ""  # why it has no metrics, in one line; empty if it has
    metrics: Mapping[str, float | None] = field(default_factory=dict)  # empty for a run that failed

    def value(self, metric: str) -> float:
        """A metric; NaN where the run has none."""
        found = self.metrics.get(metric)
        return math.nan if found is None else float(found)


def parse_axis(text: str) -> Axis:
    """Parse a swept parameter: `node.param=` and a range `start:stop:count`, with `:log` if spaced logarithmically, or a list."""
    name, equals, given = text.partition("=")
    if not (equals and name.strip() and given.strip()):
        raise ParameterError(f"sweep must be {FORM} (got {text})")
    if ":" in given:
        return Axis(name.strip(), _range(text, given.split(":")))
    try:  # as a YAML list, so that values may be numbers, texts or lists themselves
        values = tuple(read_yaml(f"[{given}]"))
    except yaml.YAMLError:
        raise ParameterError(f"sweep must be {FORM} (got {text})") from None
    return Axis(name.strip(), values)


def _range(text: str, parts: Sequence[str]) -> tuple[float, ...]:
    """The values of a range: equally spaced, or with equal ratios."""
    try:
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (IndexError, ValueError):
        raise ParameterError(f"sweep must be {FORM} (got {text})") from None
    if parts[3:] not in ([], ["log"]) or not (math.isfinite(start) and math.isfinite(stop)):
        raise ParameterError(f"sweep must be {FORM} (got {text})")
    if not 2 <= count <= MAX_SWEEP_POINTS:
        raise ParameterError(f"count of the sweep must be an integer from 2 to {MAX_SWEEP_POINTS} (got {text})")
    if parts[3:] and not start * stop > 0.0:
        raise ParameterError(f"start and stop of a sweep with log must be numbers of the same sign, not 0 (got {text})")
    # Rounded to 12 digits: 0.3 instead of 0.30000000000000004.
    values = tuple(float(f"{value:.12g}") for value in (np.geomspace if parts[3:] else np.linspace)(start, stop, count))
    whole = all(value.is_integer() for value in values) and not any(c in parts[0] + parts[1] for c in ".eE")
    return tuple(map(int, values)) if whole else values


def points(
    scenario: str, axes: Sequence[Axis], changes: Mapping[str, object] | None = None, laws: Sequence[str] = ()
) -> list[Point]:
    """Plan the runs of a sweep, law by law; the last of its one or two parameters changes fastest."""
    names = [axis.parameter for axis in axes]
    if not 1 <= len(set(names)) == len(names) <= 2:
        raise ParameterError(f"sweep must have one or two different parameters (got {' and '.join(names) or 'nothing'})")
    combinations = list(itertools.product(*(axis.values for axis in axes)))
    return [
        Point(scenario, values, {**(changes or {}), **selected, **dict(zip(names, values, strict=True))}, law)
        for law, selected in [(law, {LAW: law}) for law in laws] or [("", {})]
        for values in combinations
    ]


def run_all(
    planned: Sequence[Point], jobs: int | None = None, on_result: Callable[[Outcome], None] = lambda _: None
) -> list[Outcome]:
    """Run all points on so many cores, None for all; a run that is unstable or fails is an outcome, not an error.

    All scenarios are checked before the first one runs.
    """
    made = [_scenario(point) for point in planned]
    valid = {i: each for i, each in enumerate(made) if isinstance(each, Scenario)}
    outcomes: dict[int, Outcome] = {}

    def note(i: int, outcome: Outcome) -> None:
        outcomes[i] = outcome
        on_result(outcome)

    for i, reason in enumerate(made):
        if isinstance(reason, str):
            note(i, Outcome(planned[i], reason))
    places = list(valid)

    def simulated(found: batch.Outcome) -> None:
        i = places[found.index]
        note(i, Outcome(planned[i], found.failure, found.metrics._asdict() if found.metrics else {}))

    ensure_compiled(list(valid.values()))
    batch.simulate_many(valid.values(), workers=jobs, on_result=simulated)
    return [outcomes[i] for i in range(len(planned))]


def _scenario(point: Point) -> Scenario | str:
    """The scenario of a point; the reason where a gain is unstable, because a sweep shows where that begins."""
    try:
        return load_scenario(point.scenario, point.changes)
    except InstabilityError as error:
        return str(error)


def check_metrics(names: Sequence[str]) -> None:
    """Check names of metrics."""
    for name in names:
        if name not in Metrics._fields:
            raise ParameterError(f"--metric must be any of {', '.join(Metrics._fields)} (got {name})")


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
    found = []
    for outcome in outcomes:
        if outcome.failure:
            values = [f"{axis.parameter} = {shown(value)}" for axis, value in zip(axes, outcome.point.values, strict=True)]
            found.append(f"{', '.join(filter(None, (outcome.point.law, *values)))}: {outcome.failure}")
    return found


def shown(value: object) -> str:
    """A value of a parameter as text."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def write(folder: Path, axes: Sequence[Axis], outcomes: Sequence[Outcome], metrics: Sequence[str]) -> dict[str, Path]:
    """Write sweep.csv with all metrics, sweep.json, sweep.png and sweep.html; returns their paths by kind."""
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


def draw(path: Path, axes: Sequence[Axis], outcomes: Sequence[Outcome], metrics: Sequence[str]) -> None:
    """Draw each metric: lines over one parameter, one for each law; heat maps over two, a row of them for each law."""
    of_laws: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        of_laws.setdefault(outcome.point.law, []).append(outcome)
    if len(axes) == 1:
        with figure(path, 8.0, 3.0 * len(metrics) + 0.6) as picture:
            for panel, metric in zip(picture.subplots(len(metrics), 1, squeeze=False)[:, 0], metrics, strict=True):
                _lines(panel, axes[0], of_laws, metric)
        return
    with figure(path, 5.2 * len(metrics) + 0.6, 4.2 * len(of_laws)) as picture:
        rows = picture.subplots(len(of_laws), len(metrics), squeeze=False)
        for panels, (law, runs) in zip(rows, of_laws.items(), strict=True):
            for panel, metric in zip(panels, metrics, strict=True):
                _heat_map(panel, axes, runs, metric, law)


def _lines(panel: "Axes", axis: Axis, of_laws: Mapping[str, Sequence[Outcome]], metric: str) -> None:
    """A metric over one parameter; a cross at the top marks a run that failed."""
    places = np.array(axis.values, float) if axis.numeric else np.arange(float(len(axis.values)))
    for i, (law, runs) in enumerate(of_laws.items()):
        colour = SERIES[i % len(SERIES)]
        panel.plot(places, [run.value(metric) for run in runs], "o-", color=colour, ms=4, lw=1.2, label=law)
        if failed := [x for x, run in zip(places, runs, strict=True) if run.failure]:
            # At the top edge, whatever the scale: there is no value to draw them at.
            look: Any = {"color": colour if len(of_laws) > 1 else LIMIT, "ms": 8, "mew": 2, "label": f"{law} failed".strip()}
            panel.plot(failed, [0.96] * len(failed), "x", transform=panel.get_xaxis_transform(), **look)
    if spans(np.array([run.value(metric) for runs in of_laws.values() for run in runs])):
        panel.set_yscale("log")
    if not axis.numeric:
        panel.set_xticks(places, [shown(value) for value in axis.values])
    elif spans(places):
        panel.set_xscale("log")
    panel.yaxis.set_major_formatter(lambda value, _: text(metric, value))
    panel.set(xlabel=axis.parameter, title=label(metric))
    if len(of_laws) > 1 or len(panel.lines) > 1:
        panel.legend(loc="best")


def _heat_map(panel: "Axes", axes: Sequence[Axis], outcomes: Sequence[Outcome], metric: str, law: str) -> None:
    """A metric over two parameters, in cells of equal size whatever their values; a cross marks a run that failed."""
    shape = len(axes[0].values), len(axes[1].values)
    values = np.array([outcome.value(metric) for outcome in outcomes]).reshape(shape)
    norm = "log" if spans(values) else "linear"
    image = panel.imshow(np.ma.masked_invalid(values), origin="lower", aspect="auto", cmap="viridis_r", norm=norm)
    panel.set_facecolor("#e3e6e9")
    panel.grid(visible=False)
    rows, columns = np.divmod([i for i, outcome in enumerate(outcomes) if outcome.failure], shape[1])
    panel.plot(columns, rows, "x", color=LIMIT, ms=8, mew=2)
    if max(shape) <= MAX_TICKS:
        plate: Any = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8}
        for (row, column), value in np.ndenumerate(values):
            if math.isfinite(value):
                panel.text(column, row, text(metric, value), ha="center", va="center", fontsize=7, bbox=plate)
    for scale, axis in ((panel.yaxis, axes[0]), (panel.xaxis, axes[1])):
        ticks = range(0, len(axis.values), max(1, -(-len(axis.values) // MAX_TICKS)))
        scale.set_ticks(list(ticks), [shown(axis.values[i]) for i in ticks])
    panel.set(xlabel=axes[1].parameter, ylabel=axes[0].parameter, title=": ".join(filter(None, (law, label(metric)))))
    if np.isfinite(values).any():
        bar = panel.figure.colorbar(image, ax=panel)
        bar.ax.yaxis.set_major_formatter(lambda value, _: text(metric, value))
