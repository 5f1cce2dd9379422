"""The diagrams of a campaign as PNG files."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from vessel_hsmc_ros.campaign.diagrams import Axis, Bars, Diagrams, Exceedance, Scatter
from vessel_hsmc_ros.campaign.findings import short
from vessel_hsmc_ros.report.style import LIMIT, NEUTRAL, SERIES, figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = 2
SIZE = 5.2, 3.8
"""Width and height of a diagram, in inches."""

Drawn = TypeVar("Drawn")


def draw(folder: Path, drawn: Diagrams) -> dict[str, Path]:
    """Draw all diagrams.

    `drawn`: the diagrams; kinds that there are none of have no file.

    Raises:
        OSError: a file cannot be written.
    """
    folder.mkdir(exist_ok=True)
    laws = list(dict.fromkeys(curve.law for each in drawn.exceedances for curve in each.curves))

    def bars(panel: "Axes", each: Bars) -> None:
        _bars(panel, each, SERIES[laws.index(each.law) % len(SERIES)])

    found = {
        "distributions": _picture(folder / "distributions.png", drawn.exceedances, _exceedance),
        "parameters": _picture(folder / "parameters.png", drawn.bars, bars),
        "scatter": _picture(folder / "scatter.png", drawn.scatters, _scatter),
        "map": _picture(folder / "map.png", drawn.maps, _map),
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


def _exceedance(panel: "Axes", drawn: Exceedance) -> None:
    _scale(panel, drawn.axis, Axis("share of runs above", logarithmic=True))
    for colour, curve in zip(SERIES * (1 + len(drawn.curves) // len(SERIES)), drawn.curves, strict=False):
        panel.fill_between(curve.value, curve.low, curve.high, color=colour, alpha=0.18, lw=0, step="post")
        panel.step(curve.value, curve.share, color=colour, lw=1.4, where="post", label=curve.law)
    steps = [float(curve.share[curve.share > 0.0].min()) for curve in drawn.curves if np.any(curve.share > 0.0)]
    panel.set_ylim(0.5 * min(steps, default=0.1), 1.1)
    if drawn.limit is not None:
        panel.axvline(drawn.limit, color=LIMIT, lw=1.0, ls="--", label="limit")
    panel.legend(loc="lower left")


def _bars(panel: "Axes", drawn: Bars, colour: str) -> None:
    names = [short(entry.parameter) for entry in drawn.entries]
    lengths = [100.0 * max(entry.first_order, 0.0) for entry in drawn.entries]
    spreads = [100.0 * entry.uncertainty for entry in drawn.entries]
    panel.barh(names, lengths, xerr=spreads, color=colour, error_kw={"ecolor": NEUTRAL, "capsize": 2})
    panel.set(xlabel="explained variance of the ranks [%]", title=f"{drawn.law}:\n{drawn.metric}")
    panel.set_xlim(left=0.0)


def _scatter(panel: "Axes", drawn: Scatter) -> None:
    """Runs as points; crosses are failures, at the top edge those that ended early."""
    _scale(panel, drawn.x, drawn.y)
    x, y, shade = drawn.values
    there = np.isfinite(y)
    _points(panel, drawn, x, np.where(there, y, np.nan), shade, 12.0)
    if not there.all():
        panel.plot(x[~there], np.full(np.sum(~there), 0.97), "x", color=LIMIT, ms=5, transform=panel.get_xaxis_transform())
    panel.set_title(drawn.law)


def _map(panel: "Axes", drawn: Scatter) -> None:
    """Runs in the plane of two parameters; red crosses ended early."""
    _scale(panel, drawn.x, drawn.y)
    x, y, shade = drawn.values
    _points(panel, drawn, x, y, shade, max(9.0, min(120.0, 3.2e4 / len(x))), "s")
    panel.plot(x[drawn.ended], y[drawn.ended], "x", color=LIMIT, ms=5)
    unknown = ~np.isfinite(shade) & ~drawn.ended  # the error has not settled
    panel.plot(x[unknown], y[unknown], "x", color=NEUTRAL, ms=5)
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_title(drawn.law)


def _points(panel: "Axes", drawn: Scatter, x: Any, y: Any, shade: Any, size: float, marker: str = "o") -> None:
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
