"""The diagrams of a campaign as numbers, from which the page is drawn, and as PNG files."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.quantities import scaled
from vessel_hsmc_ros.report.style import LIMIT, NEUTRAL, SERIES, figure
from vessel_hsmc_ros.report.tables import METRICS, label
from vessel_hsmc_ros.studies.campaign.findings import short
from vessel_hsmc_ros.studies.campaign.results import LEGS, Results
from vessel_hsmc_ros.studies.campaign.statistics import Influence, exceedance
from vessel_hsmc_ros.studies.compare.sweep_page import LOGARITHMIC_RATIO

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINTS = 3000  # largest number of runs of a law in a scatter diagram
BARS = 10  # largest number of parameters with a bar
STRONGEST = 2  # number of parameters over which the runs are drawn one by one


AT_THE_END = 0.01  # share of the duration before the end of a run in which a settling time is that of the end
SETTLING, START = "settling_time", ("vessel_sim.initial_pose[0]", "vessel_sim.initial_pose[1]")


class Axis(NamedTuple):
    """A quantity that is drawn: its name with the unit, and whether its scale is logarithmic."""

    name: str
    logarithmic: bool = False


class Curve(NamedTuple):
    """The share of a law's runs above each value, with pointwise confidence bounds, (n,) each."""

    law: str
    value: Array
    share: Array
    low: Array
    high: Array


class Exceedance(NamedTuple):
    """Exceedance curves of a metric, one for each law, with its limit if there is one."""

    axis: Axis
    limit: float | None
    curves: tuple[Curve, ...]


class Bars(NamedTuple):
    """Sensitivity indices of the main metric of a law, the strongest last, which is drawn at the top."""

    law: str
    metric: str
    entries: tuple[Influence, ...]


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


class Diagrams(NamedTuple):
    """All diagrams of a report."""

    exceedances: tuple[Exceedance, ...]
    bars: tuple[Bars, ...]
    scatters: tuple[Scatter, ...]
    maps: tuple[Scatter, ...]


def diagrams(results: Results, found: Mapping[str, Sequence[Influence]]) -> Diagrams:
    """The diagrams of a campaign.

    `found`: the influences on the main metric for each law, strongest first.
    """
    bars = tuple(Bars(law, label(results.main), tuple(entries[:BARS][::-1])) for law, entries in found.items() if entries)
    return Diagrams(
        tuple(_exceedance(results, metric) for metric in results.shown if metric != SETTLING or _settles(results)),
        bars,
        tuple(itertools.chain.from_iterable(_scatters(results, law, entries) for law, entries in found.items())),
        tuple(_map(results, law, plane) for plane in [_plane(results)] if plane for law in results.by_variant),
    )


def _settles(results: Results) -> bool:
    """Whether settling times mean anything: not in surveys and on paths, nor where every error settles at the end of its run."""
    if SETTLING in {**results.campaign.limits, **results.campaign.limits_in_lengths}:
        return True
    end = (1.0 - AT_THE_END) * results.campaign.base.vessel_sim.duration
    times = results.cost(SETTLING)
    return LEGS not in results.metrics and not bool(np.all(times[np.isfinite(times)] >= end))


def _metric(runs: Results, metric: str, every: Results) -> tuple[Axis, Array]:
    """A metric of some runs with its axis, whose unit and scale suit the values of all runs."""
    factor, unit = _unit(metric, every)
    values = np.append(every.cost(metric), every.campaign.limits.get(metric, 0.0))
    positive = values[np.isfinite(values) & (values > 0.0)]
    wide = bool(len(positive)) and bool(positive.max() / positive.min() > LOGARITHMIC_RATIO)
    return Axis(f"{label(metric)} [{unit}]" if unit else label(metric), wide), factor * runs.cost(metric)


def _unit(metric: str, every: Results) -> tuple[float, str]:
    """The factor that converts a metric to the drawn unit, and this unit."""
    if metric in every.campaign.limits_in_lengths:
        return 1.0, "lengths"
    values, unit = every.cost(metric), METRICS[metric][1]
    largest = float(np.max(values, where=np.isfinite(values), initial=0.0))
    return (100.0, unit) if unit == "%" else scaled(largest, unit)


def _exceedance(results: Results, metric: str) -> Exceedance:
    curves = [Curve(law, *exceedance(_metric(runs, metric, results)[1])) for law, runs in results.by_variant.items()]
    if not results.campaign.independent:  # without a band: confidence takes independent draws
        curves = [curve._replace(low=curve.share, high=curve.share) for curve in curves]
    limit = {**results.campaign.limits, **results.campaign.limits_in_lengths}.get(metric)
    drawn = None if limit is None else _unit(metric, results)[0] * limit
    return Exceedance(_metric(results, metric, results)[0], drawn, tuple(curves))


def _scatters(results: Results, law: str, entries: Sequence[Influence]) -> list[Scatter]:
    """The main metric over the strongest parameters that are numbers, coloured by the other one of the two."""
    runs = results.by_variant[law]
    names = [entry.parameter for entry in entries if _numeric(runs.drawn[entry.parameter])][:STRONGEST]
    metric = _metric(runs, results.main, results)
    return [
        _scatter(runs, law, _drawn(runs, name), metric, _drawn(runs, other))
        for name, other in zip(names, reversed(names), strict=True)
    ]


def _map(results: Results, law: str, plane: tuple[str, str]) -> Scatter:
    """Each run in the plane of two drawn parameters: from a start the time to settle, else the main metric."""
    runs = results.by_variant[law]
    metric = SETTLING if plane == START and SETTLING in results.metrics else results.main
    return _scatter(runs, law, _drawn(runs, plane[0]), _drawn(runs, plane[1]), _metric(runs, metric, results))


def _plane(results: Results) -> tuple[str, str] | None:
    """The two parameters that span a map: those on grids if there are two, else the position of the start."""
    for names in (tuple(results.campaign.grids), START):
        if len(names) == 2 and all(name in results.drawn and _numeric(results.drawn[name]) for name in names):
            return names[0], names[1]
    return None


def _scatter(runs: Results, law: str, x: tuple[Axis, Any], y: tuple[Axis, Any], colour: tuple[Axis, Any]) -> Scatter:
    """At most as many runs as can be distinguished: the failures first, then others in equal steps."""
    order = np.argsort(~runs.failed, kind="stable")
    failures = order[: min(int(runs.failed.sum()), POINTS // 2)]
    others = order[int(runs.failed.sum()) :]
    rest = others[np.unique(np.linspace(0, len(others) - 1, min(len(others), POINTS - len(failures))).astype(int))]
    chosen = np.concatenate([failures, rest])
    values = np.array([np.asarray(column, dtype=float)[chosen] for _, column in (x, y, colour)])
    rows = runs.rows["run"].astype(np.int64)
    return Scatter(law, x[0], y[0], colour[0], values, rows[chosen], runs.failed[chosen], runs.ended_early[chosen])


def _drawn(runs: Results, name: str) -> tuple[Axis, Any]:
    return Axis(short(name)), runs.drawn[name]


def _numeric(column: NDArray[Any]) -> bool:
    return column.dtype.kind in "fiu"


COLUMNS = 2
SIZE = 5.2, 3.8  # width and height of a diagram, in inches
Drawn = TypeVar("Drawn")


def draw(folder: Path, drawn: Diagrams) -> dict[str, Path]:
    """Draw all diagrams.

    `drawn`: the diagrams; kinds that there are none of have no file. Raises OSError if a file cannot be written.
    """
    folder.mkdir(exist_ok=True)
    laws = list(dict.fromkeys(curve.law for each in drawn.exceedances for curve in each.curves))

    def bars(panel: "Axes", each: Bars) -> None:
        _draw_bars(panel, each, SERIES[laws.index(each.law) % len(SERIES)])

    found = {
        "distributions": _picture(folder / "distributions.png", drawn.exceedances, _draw_exceedance),
        "parameters": _picture(folder / "parameters.png", drawn.bars, bars),
        "scatter": _picture(folder / "scatter.png", drawn.scatters, _draw_scatter),
        "map": _picture(folder / "map.png", drawn.maps, _draw_map),
    }
    return {kind: path for kind, path in found.items() if path}


def _picture(path: Path, drawn: Sequence[Drawn], panel: Callable[["Axes", Drawn], None]) -> Path | None:
    """Draw diagrams of a kind side by side; None where there are none."""
    if not drawn:
        return None
    columns = min(COLUMNS, len(drawn))
    rows = -(-len(drawn) // columns)
    with figure(path, SIZE[0] * columns, SIZE[1] * rows) as picture:
        panels = picture.subplots(rows, columns, squeeze=False).ravel()
        for axes, each in zip(panels, drawn, strict=False):
            panel(axes, each)
        for axes in panels[len(drawn) :]:
            axes.remove()
    return path


def _draw_exceedance(panel: "Axes", drawn: Exceedance) -> None:
    _scale(panel, drawn.axis, Axis("share of runs above", logarithmic=True))
    for colour, curve in zip(SERIES * (1 + len(drawn.curves) // len(SERIES)), drawn.curves, strict=False):
        panel.fill_between(curve.value, curve.low, curve.high, color=colour, alpha=0.18, lw=0, step="post")
        panel.step(curve.value, curve.share, color=colour, lw=1.4, where="post", label=curve.law)
    steps = [float(curve.share[curve.share > 0.0].min()) for curve in drawn.curves if np.any(curve.share > 0.0)]
    panel.set_ylim(0.5 * min(steps, default=0.1), 1.1)
    if drawn.limit is not None:
        panel.axvline(drawn.limit, color=LIMIT, lw=1.0, ls="--", label="limit")
    panel.legend(loc="lower left")


def _draw_bars(panel: "Axes", drawn: Bars, colour: str) -> None:
    names = [short(entry.parameter) for entry in drawn.entries]
    lengths = [100.0 * max(entry.first_order, 0.0) for entry in drawn.entries]
    spreads = [100.0 * entry.uncertainty for entry in drawn.entries]
    panel.barh(names, lengths, xerr=spreads, color=colour, error_kw={"ecolor": NEUTRAL, "capsize": 2})
    panel.set(xlabel="explained variance of the ranks [%]", title=f"{drawn.law}:\n{drawn.metric}")
    panel.set_xlim(left=0.0)


def _draw_scatter(panel: "Axes", drawn: Scatter) -> None:
    """Runs as points; crosses are failures, at the top edge those that ended early."""
    _scale(panel, drawn.x, drawn.y)
    x, y, shade = drawn.values
    there = np.isfinite(y)
    _draw_points(panel, drawn, x, np.where(there, y, np.nan), shade, 12.0)
    if not there.all():
        panel.plot(x[~there], np.full(np.sum(~there), 0.97), "x", color=LIMIT, ms=5, transform=panel.get_xaxis_transform())
    panel.set_title(drawn.law)


def _draw_map(panel: "Axes", drawn: Scatter) -> None:
    """Runs in the plane of two parameters; red crosses ended early."""
    _scale(panel, drawn.x, drawn.y)
    x, y, shade = drawn.values
    _draw_points(panel, drawn, x, y, shade, max(9.0, min(120.0, 3.2e4 / len(x))), "s")
    panel.plot(x[drawn.ended], y[drawn.ended], "x", color=LIMIT, ms=5)
    unknown = ~np.isfinite(shade) & ~drawn.ended  # the error has not settled
    panel.plot(x[unknown], y[unknown], "x", color=NEUTRAL, ms=5)
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_title(drawn.law)


def _draw_points(panel: "Axes", drawn: Scatter, x: Any, y: Any, shade: Any, size: float, marker: str = "o") -> None:
    from matplotlib.colors import LogNorm, Normalize

    finite = shade[np.isfinite(shade) & ((shade > 0.0) | (not drawn.colour.logarithmic))]
    if not len(finite):
        return
    norm = (LogNorm if drawn.colour.logarithmic else Normalize)(finite.min(), finite.max())
    for failed, symbol in ((False, marker), (True, "X")):
        chosen = (drawn.failed == failed) & ~drawn.ended & np.isfinite(shade)
        look: Any = {"c": shade[chosen], "s": size, "marker": symbol, "norm": norm, "cmap": "viridis_r"}
        found = panel.scatter(x[chosen], y[chosen], **look, linewidths=0.8 * failed, edgecolors=LIMIT if failed else None)
    panel.figure.colorbar(found, ax=panel, label=drawn.colour.name)


def _scale(panel: "Axes", x: Axis, y: Axis) -> None:
    panel.set(xlabel=x.name, ylabel=y.name)
    if x.logarithmic:
        panel.set_xscale("log")
    if y.logarithmic:
        panel.set_yscale("log")
