"""The kit of diagrams: figures of Plotly, which pages draw in the colours of their theme, and pictures of the same figures.

Colours are names of the style sheet, such as --limit, or --run-0/0.2 with an opacity.
"""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.report.style import figure, page_colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Figure = dict[str, Any]  # title, traces and layout

DIGITS = 5  # significant digits of the drawn numbers
POINTS = 1500  # approximate number of points of a line
COLUMNS, SIZE = 2, (5.2, 3.8)  # of a picture: diagrams side by side; width and height of each, inches
TITLE_WIDTH = 44  # longest line of the title of a diagram in a picture, characters
LOGARITHMIC_RATIO = 30.0  # ratio of the largest to the smallest value from which on a scale is logarithmic
PIXEL = 0.75  # size of a pixel of a page, points


class Axis(NamedTuple):
    """A quantity that is drawn: its name with the unit, and whether its scale is logarithmic."""

    name: str
    logarithmic: bool = False


def layout(x: Axis, y: Axis, height: int = 330, legend: bool = False) -> Figure:
    """The layout of a diagram of a height in pixels."""

    def axis(of: Axis) -> Figure:
        kind = {"type": "log", "dtick": 1} if of.logarithmic else {}
        look = {"color": "--ink-soft", "gridcolor": "--grid", "linecolor": "--grid", "zeroline": False, "exponentformat": "power"}
        return {**look, **kind, "title": {"text": of.name, "standoff": 6, "font": {"size": 12}}}

    margin = {"l": 62, "r": 16, "t": 30, "b": 48}
    return {"height": height, "margin": margin, "showlegend": legend, "annotations": [], "xaxis": axis(x), "yaxis": axis(y)}


def line(x: Array, y: Array, name: str, colour: str, mode: str = "lines", **look: Any) -> Figure:
    """A line, thinned; without a name it has no entry in the legend and is silent.

    `look`: width, dash and shape of the line, as Plotly names them.
    """
    every = max(1, len(x) // POINTS)
    return {
        "type": "scatter",
        "mode": mode,
        "x": numbers(x[::every]),
        "y": numbers(y[::every]),
        "line": {"color": colour, "width": 2.0, "dash": "solid", "shape": "linear", **look},
        "marker": {"color": colour, "size": 6},
        "name": name,
        "showlegend": bool(name),
        **({} if name else {"hoverinfo": "skip"}),
    }


def numbers(values: Array) -> list[float | None]:
    """Numbers for JSON, which has none that is not finite."""
    return [float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None for value in np.asarray(values, float).tolist()]


def spans(values: Array) -> bool:
    """Whether positive values span so much that a linear scale would hide the small ones."""
    finite = values[np.isfinite(values)]
    return bool(len(finite)) and bool(finite.min() > 0.0) and bool(finite.max() / finite.min() > LOGARITHMIC_RATIO)


def draw(path: Path, figures: Sequence[Figure]) -> Path:
    """Draw figures side by side into a PNG file. Raises OSError if it cannot be written."""
    columns = min(COLUMNS, len(figures))
    rows = -(-len(figures) // columns)
    with figure(path, SIZE[0] * columns, SIZE[1] * rows) as picture:
        panels = picture.subplots(rows, columns, squeeze=False).ravel()
        for panel, each in zip(panels, figures, strict=False):
            _draw(panel, each)
        for panel in panels[len(figures) :]:
            panel.remove()
    return path


def _draw(panel: "Axes", drawn: Figure) -> None:
    below: Any = []  # the line that a filled area reaches down to
    shaded: Any = None  # the points and the scale of their colours
    for trace in drawn["traces"]:
        x, y, name = trace["x"], trace["y"], trace.get("name", "")
        if trace["type"] == "bar":
            spread = {"xerr": trace["error_x"]["array"], "error_kw": {"ecolor": page_colour("--shared"), "capsize": 2}}
            panel.barh(y, x, color=page_colour(trace["marker"]["color"]), **spread)
        elif trace["mode"] == "markers":
            shaded = _draw_points(panel, np.array(x, float), np.array(y, float), trace["marker"]) or shaded
        elif "fill" in trace:
            panel.fill_between(x, below, y, color=page_colour(trace["fillcolor"]), lw=0, step="post")
        elif trace["line"]["width"]:
            panel.plot(x, y, color=page_colour(trace["line"]["color"]), lw=1.4, drawstyle="steps-post", label=name)
        below = y
    for shape in drawn["layout"].get("shapes", ()):
        panel.axvline(shape["x0"], color=page_colour(shape["line"]["color"]), lw=1.0, ls="--", label="limit")
    if panel.get_legend_handles_labels()[0]:
        panel.legend(loc="lower left")
    if shaded is not None:
        points, bar = shaded
        scale = panel.figure.colorbar(points, ax=panel, label=bar["title"]["text"])
        if "tickvals" in bar:
            scale.set_ticks(bar["tickvals"], labels=bar["ticktext"])
    _set_axes(panel, drawn)


def _draw_points(panel: "Axes", x: Array, y: Array, marker: Figure) -> Any:
    """Draw points; returns them with the bar of their colours, None if they have one colour."""
    look: Any = {"marker": {"x": "X", "square": "s"}.get(marker["symbol"], "o"), "s": (PIXEL * marker["size"]) ** 2}
    if isinstance(marker["color"], str):
        panel.scatter(x, y, color=page_colour(marker["color"]), **look)
        return None
    look |= {"linewidths": PIXEL * marker["line"]["width"], "edgecolors": page_colour(marker["line"]["color"])}
    shade = {"c": np.array(marker["color"], float), "vmin": marker["cmin"], "vmax": marker["cmax"], "cmap": "viridis_r"}
    return panel.scatter(x, y, **shade, **look), marker["colorbar"]


def _set_axes(panel: "Axes", drawn: Figure) -> None:
    """Names, scales and ranges of the axes, and the title where it is not the name of an axis."""
    across, up = drawn["layout"]["xaxis"], drawn["layout"]["yaxis"]
    panel.set(xlabel=across["title"]["text"], ylabel=up["title"]["text"])
    if drawn["title"] != across["title"]["text"]:
        panel.set_title(textwrap.fill(drawn["title"], TITLE_WIDTH))
    for axis, set_scale, set_limits in ((across, panel.set_xscale, panel.set_xlim), (up, panel.set_yscale, panel.set_ylim)):
        logarithmic = axis.get("type") == "log"
        if logarithmic:
            set_scale("log")
        if "range" in axis:
            set_limits(*(10.0**end if logarithmic else end for end in axis["range"]))
    if "scaleanchor" in up:
        panel.set_aspect("equal", adjustable="datalim")
