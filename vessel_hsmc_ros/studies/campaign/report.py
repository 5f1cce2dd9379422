"""The report of a campaign: a page without external resources and its figures, from the rows that there are so far."""

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.report import page_kit
from vessel_hsmc_ros.report.style import SERIES
from vessel_hsmc_ros.studies.campaign import findings, ship_findings
from vessel_hsmc_ros.studies.campaign.diagrams import Axis, Bars, Curve, Diagrams, Exceedance, Scatter, diagrams, draw
from vessel_hsmc_ros.studies.campaign.findings import influences_by_variant, sentences, short
from vessel_hsmc_ros.studies.campaign.results import Results, read
from vessel_hsmc_ros.studies.campaign.statistics import CONFIDENCE, FEWEST, Influence


def make_report(folder: Path, output: Path | None = None) -> tuple[list[str], dict[str, Path]]:
    """Write the report of a campaign, complete or not.

    `output`: the page; by default `report.html` in the folder. The figures are in `figures/` beside it. Returns the findings in
    words, and the paths by kind: page and figures. Raises CampaignError if the folder is not that of a campaign, or a file of
    it is damaged; ReportError if the campaign has no results yet, or a file cannot be written.
    """
    results = read(folder)
    found = influences_by_variant(results)
    drawn = diagrams(results, found)
    path = output or folder / "report.html"
    try:
        path.write_text(render(results, found, drawn, folder), encoding="utf-8")
        pictures = draw(path.parent / "figures", drawn)
    except OSError as error:
        raise ReportError(f"report {path} cannot be written: {error.strerror}") from None
    words = [f"{law}: {sentence}" if law else sentence for law, sentence in sentences(results, found)]
    return words, {"page": path, **pictures}


def render(results: Results, found: dict[str, list[Influence]], drawn: Diagrams, folder: Path) -> str:
    """Render the HTML text of the page.

    `found`: the influences on the main metric for each law.
    """
    campaign, laws = results.campaign, list(results.by_variant)
    shown = page_diagrams(drawn, laws)
    content = {"figures": shown, "command": findings.replay_command(folder, 0).rpartition(" ")[0]}
    return page_kit.render(
        "studies/campaign/campaign.html",
        f"Campaign {campaign.name}",
        [_subtitle(results)],
        scripts=(*page_kit.DIAGRAM_SCRIPTS, "studies/campaign/campaign.js"),
        content=content,
        sentences=findings.sentences(results, found),
        notes=_notes(results),
        colours={law: colour(law, laws) for law in laws},
        lost=ship_findings.lost(ship_findings.ships_of(results)) if campaign.has_ships else None,
        failures=findings.failures(results),
        quantiles=findings.quantiles(results),
        comparisons=findings.comparisons(results),
        causes=findings.causes(found),
        worst=findings.worst(results, folder),
        folder=folder,
        file=campaign.source.text.strip(),
        figures=shown,
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
    if not (results.campaign.limits or results.campaign.limits_in_lengths):
        found.append("The campaign has no limits, so only runs that ended early are failures.")
    return found


Figure = dict[str, Any]

DIGITS = 5  # significant digits of the drawn numbers; the dataset has all of them
AXIS: Figure = {"color": "--ink-soft", "gridcolor": "--grid", "linecolor": "--grid", "zeroline": False, "exponentformat": "power"}


def page_diagrams(drawn: Diagrams, laws: list[str]) -> dict[str, list[Figure]]:
    """Traces and layouts of all diagrams, by the section of the page that shows them."""
    return {
        "exceedance": [_exceedance(each, laws) for each in drawn.exceedances],
        "bars": [_bars(each, laws) for each in drawn.bars],
        "scatter": [_scatter(each, square=False) for each in drawn.scatters],
        "map": [_scatter(each, square=True) for each in drawn.maps],
    }


def colour(law: str, laws: list[str]) -> str:
    """The style sheet's colour of a law."""
    return f"--run-{laws.index(law) % len(SERIES)}"


def _exceedance(drawn: Exceedance, laws: list[str]) -> Figure:
    smallest = min((1.0 / _runs(curve) for curve in drawn.curves if len(curve.share)), default=0.1)
    traces = [trace for curve in drawn.curves for trace in _curve(curve, colour(curve.law, laws), 0.3 * smallest)]
    layout = _layout(drawn.axis, Axis("share of runs above", logarithmic=True))
    layout["yaxis"] |= {"range": [math.log10(0.5 * smallest), 0.05], "tickformat": "~g"}
    layout["showlegend"] = len(laws) > 1
    if drawn.limit is not None:
        line = {"type": "line", "yref": "paper", "x0": drawn.limit, "x1": drawn.limit, "y0": 0, "y1": 1}
        layout["shapes"] = [{**line, "line": {"color": "--limit", "width": 1.5, "dash": "dash"}}]
        place = math.log10(drawn.limit) if drawn.axis.logarithmic else drawn.limit
        name = {"x": place, "yref": "paper", "y": 1, "yanchor": "bottom", "text": "limit", "showarrow": False}
        layout["annotations"] = [{**name, "font": {"color": "--limit", "size": 11}}]
    return {"title": drawn.axis.name, "traces": traces, "layout": layout}


def _runs(curve: Curve) -> float:
    """Number of runs of a curve, from its largest step."""
    steps = curve.share[curve.share > 0.0]
    return 1.0 / float(steps.min()) if len(steps) else 1.0


def _curve(curve: Curve, shade: str, floor: float) -> list[Figure]:
    """The curve above its band of confidence; zero has no place on a logarithmic scale, so it is drawn at the floor."""
    x = _numbers(curve.value)
    edge = {
        "x": x,
        "type": "scatter",
        "mode": "lines",
        "line": {"width": 0, "shape": "hv"},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    low, high, share = (_numbers(np.maximum(values, floor)) for values in (curve.low, curve.high, curve.share))
    band = {**edge, "y": high, "fill": "tonexty", "fillcolor": f"{shade}/0.18"}
    line = {"color": shade, "width": 2, "shape": "hv"}
    hover = "%{y:.3~p} above %{x:.4~g}<extra>" + curve.law + "</extra>"
    middle = {"x": x, "y": share, "type": "scatter", "mode": "lines", "line": line, "name": curve.law, "hovertemplate": hover}
    return [{**edge, "y": low}, band, middle]


def _bars(drawn: Bars, laws: list[str]) -> Figure:
    indices = np.array([max(entry.first_order, 0.0) for entry in drawn.entries])
    trace = {
        "type": "bar",
        "orientation": "h",
        "x": _numbers(100.0 * indices),
        "y": [short(entry.parameter) for entry in drawn.entries],
        "customdata": [[entry.parameter, _correlation(entry.correlation)] for entry in drawn.entries],
        "error_x": {"array": _numbers(np.array([100.0 * entry.uncertainty for entry in drawn.entries])), "color": "--ink-soft"},
        "marker": {"color": colour(drawn.law, laws)},
        "hovertemplate": "%{customdata[0]}: %{x:.2~f} %<br>rank correlation %{customdata[1]}<extra></extra>",
    }
    layout = _layout(Axis("explained variance of the ranks [%]"), Axis(""))
    layout["yaxis"] |= {"automargin": True, "tickfont": {"size": 11}}
    layout["xaxis"] |= {
        "rangemode": "nonnegative",
        "range": [0, 100.0 * max(0.1, *(e.first_order + e.uncertainty for e in drawn.entries))],
    }
    layout["height"] = 110 + 26 * len(drawn.entries)
    return {"title": f"{drawn.law}: {drawn.metric}", "traces": [trace], "layout": layout}


def _correlation(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:+.2f}"


def _scatter(drawn: Scatter, square: bool) -> Figure:
    """Runs as points whose colour is a quantity; crosses are failures, red ones ended early, grey ones have no such quantity."""
    x, y, shade = drawn.values
    finite = np.isfinite(y)
    # A run without a value is at the top edge.
    top = float(y[finite].max()) * (2.0 if drawn.y.logarithmic else 1.1) if finite.any() else 1.0
    y = np.where(finite, y, top)
    size = _size(len(x), square)
    with np.errstate(divide="ignore"):
        tint = np.log10(shade) if drawn.colour.logarithmic else shade
    scale = {"colorscale": "Viridis", "reversescale": True, **_range(tint), "colorbar": _colour_bar(drawn.colour, tint)}
    traces = []
    for failed, ended, known in itertools.product((False, True), repeat=3):
        mask = (drawn.failed == failed) & (drawn.ended == ended) & (np.isfinite(tint) == known)
        if mask.any():
            look = {"symbol": "x" if failed else "square" if square else "circle", "size": size + 2 * failed}
            plain = {"color": "--limit" if ended else "--shared"}
            paint = {"color": _numbers(tint[mask]), **scale} if known and not ended else plain
            edge = {"color": "--limit", "width": 1.2 * failed}
            traces.append(_points(drawn, mask, x, y, {**look, **paint, "line": edge}))
    layout = _layout(drawn.x, drawn.y if square else drawn.y._replace(name=""))  # the name of a metric is the title
    if square:
        layout["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
        layout["xaxis"] |= {"constrain": "domain"}
        layout["height"] = 460
    return {"title": f"{drawn.law}: {(drawn.colour if square else drawn.y).name}", "traces": traces, "layout": layout}


def _points(drawn: Scatter, mask: NDArray[np.bool_], x: Array, y: Array, marker: Figure) -> Figure:
    shown = [
        "ended early" if ended else f"{value:.4g}" for value, ended in zip(drawn.values[2][mask], drawn.ended[mask], strict=True)
    ]
    # The number of the run first: a click shows the command for it.
    data = [[int(run), value] for run, value in zip(drawn.runs[mask], shown, strict=True)]
    hover = f"run %{{customdata[0]}}<br>{drawn.x.name}: %{{x:.4~g}}<br>{drawn.y.name}: %{{y:.4~g}}<br>{drawn.colour.name}: "
    return {
        "type": "scatter",
        "mode": "markers",
        "x": _numbers(x[mask]),
        "y": _numbers(y[mask]),
        "customdata": data,
        "marker": marker,
        "hovertemplate": hover + "%{customdata[1]}<extra></extra>",
    }


def _range(tint: Array) -> Figure:
    finite = tint[np.isfinite(tint)]
    return {"cmin": float(finite.min()), "cmax": float(finite.max())} if len(finite) else {}


def _colour_bar(axis: Axis, tint: Array) -> Figure:
    bar: Figure = {"thickness": 12, "outlinewidth": 0, "title": {"text": axis.name, "side": "right", "font": {"size": 11}}}
    finite = tint[np.isfinite(tint)]
    if axis.logarithmic and len(finite):
        places = np.arange(math.ceil(finite.min()), math.floor(finite.max()) + 1)
        bar |= {"tickvals": places.tolist(), "ticktext": [f"{10.0**place:g}" for place in places]}
    return bar


def _size(count: int, square: bool) -> float:
    """Diameter of a point in pixels: smaller where there are many; in a map nearly as wide as a cell of a full grid."""
    return max(4.0, min(16.0, 240.0 / math.sqrt(count))) if square else (6.0 if count < 1000 else 4.0)


def _layout(x: Axis, y: Axis) -> Figure:
    def axis(of: Axis) -> Figure:
        kind = {"type": "log", "dtick": 1} if of.logarithmic else {}
        return {**AXIS, **kind, "title": {"text": of.name, "standoff": 6, "font": {"size": 12}}}

    return {
        "height": 330,
        "margin": {"l": 62, "r": 16, "t": 30, "b": 48},
        "showlegend": False,
        "xaxis": axis(x),
        "yaxis": axis(y),
    }


def _numbers(values: Array) -> list[float | None]:
    """Numbers for JSON, which has none that is not finite."""
    return [float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None for value in values.tolist()]
