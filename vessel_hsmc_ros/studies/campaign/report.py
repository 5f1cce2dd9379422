"""The report of a campaign: a page without external resources and its figures, from the rows that there are so far."""

import itertools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.quantities import scaled
from vessel_hsmc_ros.report import page_kit
from vessel_hsmc_ros.report.diagrams import Axis, Figure, draw, layout, line, moment, numbers, points, run_colour, spans
from vessel_hsmc_ros.report.tables import METRICS, label
from vessel_hsmc_ros.studies.campaign import findings
from vessel_hsmc_ros.studies.campaign.dataset import Dataset, opened, write_sweep_rows
from vessel_hsmc_ros.studies.campaign.findings import influences_by_variant, sentences, short
from vessel_hsmc_ros.studies.campaign.results import CONFIDENCE, FEWEST, LEGS, Influence, Results, exceedance, read

PICTURES = {"exceedance": "distributions", "bars": "parameters", "scatter": "scatter", "map": "map"}
"""The kinds of the pictures, by the sections of the page whose diagrams they show."""


def make_report(folder: Path, output: Path | None = None) -> tuple[list[str], dict[str, Path]]:
    """Write the report of a campaign, complete or not. Returns the findings in words, and the paths of `write_report`."""
    results = read(folder)
    found = influences_by_variant(results)
    words = [f"{law}: {sentence}" if law else sentence for law, sentence in sentences(results, found)]
    return words, write_report(results, found, folder, output or folder / "report.html")


def write_report(results: Results, found: dict[str, list[Influence]], folder: Path, path: Path) -> dict[str, Path]:
    """Write a page of results, and its figures into `figures/` beside it; returns the paths by kind."""
    drawn = diagrams(results, found)
    with page_kit.writing(f"report {path}"):
        path.write_text(render(results, found, drawn, folder), encoding="utf-8")
        figures = path.parent / "figures"
        figures.mkdir(exist_ok=True)
        pictures = {PICTURES[kind]: draw(figures / f"{PICTURES[kind]}.png", each) for kind, each in drawn.items() if each}
    return {"page": path, **pictures}


def write_sweep(results: Results, rows: Sequence[Mapping[str, Any]], folder: Path) -> dict[str, Path]:
    """Write rows that are in no dataset: page, figures, a table, and the campaign file that repeats them or one of them."""
    dataset = Dataset(folder)
    with opened(dataset, results.campaign), page_kit.writing(f"results in {folder}"):
        write_sweep_rows(rows, dataset.sweep)
        found: dict[str, list[Influence]] = {law: [] for law in results.by_variant}
        files = write_report(results, found, folder, folder / "sweep.html")
    return files | {"csv": dataset.sweep, "plan": folder / "campaign.yaml"}


def render(results: Results, found: dict[str, list[Influence]], drawn: Mapping[str, Sequence[Figure]], folder: Path) -> str:
    """Render the HTML text of the page."""
    campaign = results.campaign
    content = {"figures": drawn, "command": findings.replay_command(folder, 0).rpartition(" ")[0]}
    return page_kit.render(
        "studies/campaign/campaign.html",
        f"Campaign {campaign.name}",
        [_subtitle(results)],
        scripts=(*page_kit.DIAGRAM_SCRIPTS, "studies/campaign/campaign.js"),
        content=content,
        sentences=findings.sentences(results, found),
        notes=_notes(results),
        colours={law: colour(results, law) for law in results.by_variant},
        failures=findings.failures(results),
        points=findings.points(results) if campaign.grids and len(results) <= MAX_POINTS else None,
        quantiles=findings.quantiles(results),
        comparisons=findings.comparisons(results),
        causes=findings.causes(found),
        worst=findings.worst(results, folder),
        folder=folder,
        file=campaign.source.text.strip(),
        figures=drawn,
        fewest=FEWEST,
        independent=campaign.independent,
        confidence=f"{100.0 * CONFIDENCE:g} %",
    )


def _subtitle(results: Results) -> str:
    """What was run, in a line."""
    campaign = results.campaign
    count = f"{campaign.runs} runs" if len(results) == campaign.runs else f"{len(results)} of {campaign.runs} runs so far"
    several = f" × {len(campaign.variants)} {campaign.variant_column}s" if len(campaign.variants) > 1 else ""
    draws = f"{campaign.draws} draws{several}"
    duration = "" if campaign.has_ships else f", {campaign.base.vessel_sim.duration:g} s"
    scenario = f"scenario {campaign.source.scenario_name}{duration}"
    return f"{count} ({draws}) · {scenario} · {', '.join(campaign.variants)} · {campaign.sampling}, seed {campaign.seed}"


def _notes(results: Results) -> list[str]:
    """What the reader must know to judge the numbers."""
    found = []
    if not results.campaign.independent and not results.campaign.grids:
        name = results.campaign.sampling.replace("_", " ")
        found.append(f"Draws by {name} are not independent, so no confidence intervals are stated.")
    if not results.campaign.limits:
        found.append("The campaign has no limits, so only runs that ended early are failures.")
    return found


MAX_POINTS = 200  # largest number of runs of a grid in a table
MAX_RUNS = 3000  # largest number of runs of a law in a scatter diagram
BARS = 10  # largest number of parameters with a bar
STRONGEST = 2  # number of parameters over which the runs are drawn one by one


AT_THE_END = 0.01  # share of the duration before the end of a run in which a settling time is that of the end
SETTLING, START = "settling_time", ("vessel_sim.initial_pose[0]", "vessel_sim.initial_pose[1]")

Quantity = tuple[Axis, Any]  # what is drawn of runs: its axis and its values, (n,)


class Scatter(NamedTuple):
    """Runs of a law one by one."""

    law: str
    # x, y, colour: what is drawn across, up and as colour
    x: Axis
    y: Axis
    colour: Axis
    values: Array  # their values, (3, n)
    runs: NDArray[np.int64]  # numbers of the runs, (n,)
    # failed, ended: whether each failed, and whether it ended early and so has no metric, (n,)
    failed: NDArray[np.bool_]
    ended: NDArray[np.bool_]


def diagrams(results: Results, found: Mapping[str, Sequence[Influence]]) -> dict[str, list[Figure]]:
    """The diagrams of a campaign, by the sections of its page."""
    plane = _plane(results)
    return {
        "exceedance": [_exceedance(results, each) for each in results.shown if each != SETTLING or _settles(results)],
        "bars": [_bars(results, law, entries[:BARS][::-1]) for law, entries in found.items() if entries],
        "scatter": list(itertools.chain.from_iterable(_scatters(results, law, entries) for law, entries in found.items())),
        "map": [_map(results, law, plane, metric) for law in results.by_variant for metric in _mapped(results, plane)]
        if plane
        else [_curve(results, metric) for metric in results.shown if results.campaign.drawn == (*results.campaign.grids,) != ()],
    }


def colour(results: Results, law: str) -> str:
    """The style sheet's colour of a law."""
    return run_colour(list(results.by_variant).index(law))


def _settles(results: Results) -> bool:
    """Whether settling times mean anything: not in surveys and on paths, nor where every error settles at the end of its run."""
    if SETTLING in results.campaign.limits:
        return True
    end = (1.0 - AT_THE_END) * results.campaign.base.vessel_sim.duration
    times = results.cost(SETTLING)
    return LEGS not in results.metrics and not bool(np.all(times[np.isfinite(times)] >= end))


def _metric(runs: Results, metric: str, every: Results) -> Quantity:
    """A metric of some runs with its axis, whose unit and scale suit the values of all runs."""
    factor, unit = _unit(metric, every)
    values = np.append(every.cost(metric), every.campaign.limits.get(metric, 0.0))
    name = f"{label(metric)} [{unit}]" if unit else label(metric)
    return Axis(name, logarithmic=spans(values[values > 0.0])), factor * runs.cost(metric)


def _unit(metric: str, every: Results) -> tuple[float, str]:
    """The factor that converts a metric to the drawn unit, and this unit."""
    if metric in every.campaign.in_lengths:
        return 1.0, "lengths"
    values, unit = every.cost(metric), METRICS[metric][1]
    largest = float(np.max(values, where=np.isfinite(values), initial=0.0))
    return (100.0, unit) if unit == "%" else scaled(largest, unit)


def _exceedance(results: Results, metric: str) -> Figure:
    """The share of the runs of each law above each value of a metric, with its limit if there is one."""
    axis = _metric(results, metric, results)[0]
    curves = {law: exceedance(_metric(runs, metric, results)[1]) for law, runs in results.by_variant.items()}
    smallest = min((float(share[share > 0.0].min()) for _, share, *_ in curves.values() if np.any(share > 0.0)), default=0.1)
    traces: list[Figure] = []
    for law, (value, share, low, high) in curves.items():
        band = (low, high) if results.campaign.independent else (share, share)  # confidence takes independent draws
        # Zero has no place on a logarithmic scale, so it is drawn at a floor.
        lower, upper, middle = (np.maximum(values, 0.3 * smallest) for values in (*band, share))
        shade = colour(results, law)
        traces.append(line(value, lower, "", shade, width=0, shape="hv"))
        traces.append({**line(value, upper, "", shade, width=0, shape="hv"), "fill": "tonexty", "fillcolor": f"{shade}/0.18"})
        hover = "%{y:.3~p} above %{x:.4~g}<extra>" + law + "</extra>"
        traces.append({**line(value, middle, law, shade, shape="hv"), "hovertemplate": hover})
    drawn = layout(axis, Axis("share of runs above", logarithmic=True), legend=len(curves) > 1)
    drawn["yaxis"] |= {"range": [math.log10(0.5 * smallest), 0.05], "tickformat": "~g"}
    limit = results.campaign.limits.get(metric)
    return {"title": axis.name, "traces": traces, "layout": drawn | _limit(axis, limit, _unit(metric, results)[0])}


def _limit(axis: Axis, limit: float | None, factor: float) -> Figure:
    """What marks a limit in a diagram over an axis."""
    if limit is None:
        return {}
    place = factor * limit
    name = {"yref": "paper", "y": 1, "yanchor": "bottom", "text": "limit", "showarrow": False}
    note = {**name, "x": math.log10(place) if axis.logarithmic else place, "font": {"color": "--limit", "size": 11}}
    return {"shapes": [moment(place, name="limit")], "annotations": [note]}


def _bars(results: Results, law: str, entries: Sequence[Influence]) -> Figure:
    """Sensitivity indices of the main metric of a law, the strongest last, which is drawn at the top."""
    indices = np.array([max(entry.first_order, 0.0) for entry in entries])
    correlations = ["–" if math.isnan(entry.correlation) else f"{entry.correlation:+.2f}" for entry in entries]
    trace = {
        "type": "bar",
        "orientation": "h",
        "x": numbers(100.0 * indices),
        "y": [short(entry.parameter) for entry in entries],
        "customdata": [list(each) for each in zip((entry.parameter for entry in entries), correlations, strict=True)],
        "error_x": {"array": numbers(np.array([100.0 * entry.uncertainty for entry in entries])), "color": "--ink-soft"},
        "marker": {"color": colour(results, law)},
        "hovertemplate": "%{customdata[0]}: %{x:.2~f} %<br>rank correlation %{customdata[1]}<extra></extra>",
    }
    drawn = layout(Axis("explained variance of the ranks [%]"), Axis(""), 110 + 26 * len(entries))
    drawn["yaxis"] |= {"automargin": True, "tickfont": {"size": 11}}
    longest = max(0.1, *(entry.first_order + entry.uncertainty for entry in entries))
    drawn["xaxis"] |= {"rangemode": "nonnegative", "range": [0, 100.0 * longest]}
    return {"title": f"{law}: {label(results.main)}", "traces": [trace], "layout": drawn}


def _scatters(results: Results, law: str, entries: Sequence[Influence]) -> list[Figure]:
    """The main metric over the strongest parameters that are numbers, coloured by the other one of the two."""
    runs = results.by_variant[law]
    names = [entry.parameter for entry in entries if _numeric(runs.drawn[entry.parameter])][:STRONGEST]
    metric = _metric(runs, results.main, results)
    return [
        _runs_as_points(_chosen(runs, law, _drawn(runs, name), metric, _drawn(runs, other)), square=False)
        for name, other in zip(names, reversed(names), strict=True)
    ]


def _map(results: Results, law: str, plane: tuple[str, str], metric: str) -> Figure:
    """Each run in the plane of two drawn parameters, coloured by a metric; cells where there is one for each pair of values."""
    runs = results.by_variant[law]
    x, y, shade = *(_drawn(runs, name) for name in plane), _metric(runs, metric, results)
    pairs = np.unique(np.column_stack([x[1], y[1]]), axis=0)
    if len(runs) == len(pairs) == len(np.unique(x[1])) * len(np.unique(y[1])):
        return _runs_as_cells(_chosen(runs, law, x, y, shade, most=2 * len(runs)))
    return _runs_as_points(_chosen(runs, law, x, y, shade), square=True)


def _mapped(results: Results, plane: tuple[str, str]) -> tuple[str, ...]:
    """The metrics of the maps: those that the file names, else from a start the time to settle, else the main one."""
    ours = SETTLING if plane == START and SETTLING in results.metrics else results.main
    return (results.campaign.metrics and results.shown) or (ours,)


def _curve(results: Results, metric: str) -> Figure:
    """A metric over the one parameter on a grid, a line for each law; crosses at the top edge are runs that ended early."""
    (name,) = results.drawn
    (axis, values), over = _metric(results, metric, results), _drawn(results, name)[0]
    traces: list[Figure] = []
    top = np.max(values, where=np.isfinite(values), initial=0.0)
    for law, runs in results.by_variant.items():
        x, y = _drawn(runs, name)[1].astype(float), _metric(runs, metric, results)[1]
        traces.append(line(x, y, law, colour(results, law), "lines+markers"))
        if (lost := ~np.isfinite(y)).any():
            traces.append(points(x[lost], np.full(int(lost.sum()), 1.1 * top), "", "--limit", "x", 10.0))
    return {"title": axis.name, "traces": traces, "layout": layout(over, axis._replace(name=""), legend=len(traces) > 1)}


def _plane(results: Results) -> tuple[str, str] | None:
    """The two parameters that span a map: those on grids if there are two, else the position of the start."""
    if len(grids := tuple(results.campaign.grids)) == 2:
        return grids[0], grids[1]
    return START if all(name in results.drawn and _numeric(results.drawn[name]) for name in START) else None


def _drawn(runs: Results, name: str) -> Quantity:
    column = runs.drawn[name]
    if _numeric(column):
        return Axis(short(name), logarithmic=name in runs.campaign.grids and spans(column)), column
    names, places = np.unique(column, return_inverse=True)
    return Axis(short(name), ticks=tuple(map(str, names))), places


def _numeric(column: NDArray[Any]) -> bool:
    return column.dtype.kind in "fiu"


def _chosen(runs: Results, law: str, x: Quantity, y: Quantity, colour: Quantity, most: int = MAX_RUNS) -> Scatter:
    """At most as many runs as can be distinguished: the failures first, then others in equal steps."""
    order = np.argsort(~runs.failed, kind="stable")
    failures = order[: min(int(runs.failed.sum()), most // 2)]
    others = order[int(runs.failed.sum()) :]
    rest = others[np.unique(np.linspace(0, len(others) - 1, min(len(others), most - len(failures))).astype(int))]
    chosen = np.concatenate([failures, rest])
    values = np.array([np.asarray(column, dtype=float)[chosen] for _, column in (x, y, colour)])
    rows = runs.rows["run"].astype(np.int64)
    return Scatter(law, x[0], y[0], colour[0], values, rows[chosen], runs.failed[chosen], runs.ended_early[chosen])


def _runs_as_points(drawn: Scatter, square: bool) -> Figure:
    """Runs as points whose colour is a quantity; crosses are failures, red ones ended early, grey ones have no such quantity."""
    x, y, _ = drawn.values
    finite = np.isfinite(y)
    # A run without a value is at the top edge.
    top = float(y[finite].max()) * (2.0 if drawn.y.logarithmic else 1.1) if finite.any() else 1.0
    y = np.where(finite, y, top)
    # Smaller points where there are many; in a map nearly as wide as a cell of a full grid.
    size = max(4.0, min(16.0, 240.0 / math.sqrt(len(x)))) if square else (6.0 if len(x) < 1000 else 4.0)
    tint, (low, high), bar = _scale(drawn)
    scale = {"colorscale": "Viridis", "reversescale": True, "cmin": low, "cmax": high, "colorbar": bar}
    traces = []
    for failed, ended, known in itertools.product((False, True), repeat=3):
        mask = (drawn.failed == failed) & (drawn.ended == ended) & (np.isfinite(tint) == known)
        if mask.any():
            look = {"symbol": "x" if failed else "square" if square else "circle", "size": size + 2 * failed}
            plain = {"color": "--limit" if ended else "--shared"}
            paint = {"color": numbers(tint[mask]), **scale} if known and not ended else plain
            edge = {"color": "--limit", "width": 1.2 * failed}
            traces.append(_points(drawn, mask, x, y, {**look, **paint, "line": edge}))
    return _framed(drawn, traces, square)


def _runs_as_cells(drawn: Scatter) -> Figure:
    """Runs as cells whose colour is a quantity, empty without one; crosses are failures, filled ones ended early."""
    x, y, _ = drawn.values
    order, across, up = np.lexsort((x, y)), np.unique(x), np.unique(y)
    tint, (low, high), bar = _scale(drawn)
    tints, data = numbers(tint[order]), _hover_data(drawn, order)
    lines = [slice(start, start + len(across)) for start in range(0, len(x), len(across))]
    cells = {
        "type": "heatmap",
        "x": numbers(_edges(across, drawn.x.logarithmic)),
        "y": numbers(_edges(up, drawn.y.logarithmic)),
        "z": [tints[each] for each in lines],
        "customdata": [data[each] for each in lines],
        **{"colorscale": "Viridis", "reversescale": True, "zmin": low, "zmax": high, "colorbar": bar},
        "hovertemplate": _hover(drawn),
    }
    traces = [cells]
    for ended in (False, True):
        if (mask := drawn.failed & (drawn.ended == ended)).any():
            look = {"symbol": "x", "size": 10, "color": "--limit" if ended else "--card"}
            traces.append(_points(drawn, mask, x, y, {**look, "line": {"color": "--limit", "width": 1.2}}))
    return _framed(drawn, traces, square=True)


def _edges(centres: Array, logarithmic: bool) -> Array:
    """The edges of cells around values, midway between them on their scale, (n + 1,)."""
    places = np.log(centres) if logarithmic else centres
    steps = np.diff(places) if len(places) > 1 else np.ones(1)
    padded = np.array([places[0] - steps[0], *places, places[-1] + steps[-1]])
    middles = 0.5 * (padded[1:] + padded[:-1])
    return np.asarray(np.exp(middles) if logarithmic else middles)


def _framed(drawn: Scatter, traces: Sequence[Figure], square: bool) -> Figure:
    """Traces of runs with their axes and title."""
    # The name of a metric is the title.
    found = layout(drawn.x, drawn.y if square else drawn.y._replace(name=""), height=460 if square else 330)
    if {drawn.x.name, drawn.y.name} == {short(name) for name in START}:
        found["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
        found["xaxis"] |= {"constrain": "domain"}
    return {"title": f"{drawn.law}: {(drawn.colour if square else drawn.y).name}", "traces": traces, "layout": found}


def _points(drawn: Scatter, mask: NDArray[np.bool_], x: Array, y: Array, marker: Figure) -> Figure:
    return {
        "type": "scatter",
        "mode": "markers",
        "x": numbers(x[mask]),
        "y": numbers(y[mask]),
        "customdata": _hover_data(drawn, np.flatnonzero(mask)),
        "marker": marker,
        "hovertemplate": _hover(drawn),
    }


def _hover_data(drawn: Scatter, runs: NDArray[np.int64]) -> list[list[Any]]:
    """What is shown of runs, the number first: a click shows the command for it."""

    def text(axis: Axis, value: float) -> str:
        if not math.isfinite(value):
            return "none"
        return axis.ticks[int(value)] if axis.ticks else f"{value:.4g}"

    return [
        [
            int(drawn.runs[run]),
            *(text(axis, value) for axis, value in zip((drawn.x, drawn.y), drawn.values[:2, run], strict=True)),
            "ended early" if drawn.ended[run] else text(drawn.colour, drawn.values[2, run]),
        ]
        for run in runs
    ]


def _hover(drawn: Scatter) -> str:
    names = enumerate((drawn.x.name, drawn.y.name, drawn.colour.name), 1)
    return "run %{customdata[0]}" + "".join(f"<br>{name}: %{{customdata[{i}]}}" for i, name in names) + "<extra></extra>"


def _scale(drawn: Scatter) -> tuple[Array, tuple[float | None, float | None], Figure]:
    """The quantity that is a colour, on its scale; its range, and the bar that shows it."""
    with np.errstate(divide="ignore"):
        tint = np.log10(drawn.values[2]) if drawn.colour.logarithmic else drawn.values[2]
    title = {"text": drawn.colour.name, "side": "right", "font": {"size": 11}}
    bar: Figure = {"thickness": 12, "outlinewidth": 0, "title": title}
    finite = tint[np.isfinite(tint)]
    if not len(finite):
        return tint, (None, None), bar
    low, high = float(finite.min()), float(finite.max())
    if drawn.colour.logarithmic:
        places = np.arange(math.ceil(low), math.floor(high) + 1)
        bar |= {"tickvals": places.tolist(), "ticktext": [f"{10.0**place:g}" for place in places]}
    return tint, (low, high), bar
