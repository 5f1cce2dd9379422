"""The kit of diagrams: figures of Plotly, which pages draw in the colours of their theme, and pictures of the same figures.

Colours are names of the style sheet, such as --limit, or --run-0/0.2 with an opacity.
"""

import math
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture


SERIES = ("#0072b2", "#d55e00", "#00875f", "#b0478a", "#8a6d00", "#4b4bc8")
"""Blue, vermilion, green, purple, olive, indigo: the colours of lines, or of runs, in this order."""

SHIP, REFERENCE = SERIES[:2]
LAW_COLOURS = dict(zip(("hierarchical", "hierarchical_printed", "guided", "los_pid", "nmpc"), SERIES, strict=False))
"""Colours of the laws, the same in every figure; other laws take the next ones."""

NEUTRAL, LIMIT, INK = "#6b7782", "#b3261e", "#17212b"
"""Shared or measured quantities, saturation limits, and nearly black for what is true by definition."""

DARK_SERIES = ("#56b4e9", "#f08c3a", "#3ccf9a", "#e58fc3", "#e0c14a", "#9d9dfb")
"""The same hues on a dark page."""

ROLES = {
    "main": ("--ship", 1.6, "solid"),
    "desired": ("--reference", 1.4, "6px,4px"),
    "other": ("--other", 1.4, "2px,2px"),
    "third": ("--third", 1.4, "8px,3px,2px,3px"),
    "measured": ("--shared", 0.8, "solid"),
}
"""Colour of a line of a single run, its width and its dashes, by its role in a panel."""

LIMIT_DASHES = ("6px,3px", "2px,3px", "8px,3px,2px,3px")
"""Dashes of the limits of a panel, in turn."""

PLOT: Any = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "font.size": 9,
    "grid.alpha": 0.3,
    "legend.frameon": False,
    "savefig.dpi": 130,
}
"""matplotlib settings of all figures."""

_LIGHT_PAGE = {
    "page": "#f5f7f9",
    "card": "#ffffff",
    "ink": INK,
    "ink-soft": "#566472",
    "grid": "#e1e7ec",
    "edge": "#d6dde4",
    "accent": "#0b62a4",
    "limit": LIMIT,
    "cursor": INK,
    "water": "#eef4f8",
    "plan": "#c4d3de",
    "shared": NEUTRAL,
}
_DARK_PAGE = {
    "page": "#10161c",
    "card": "#182129",
    "ink": "#e6edf3",
    "ink-soft": "#9fb0bf",
    "grid": "#2a3641",
    "edge": "#2f3c48",
    "accent": "#6cb6f2",
    "limit": "#ff8a80",
    "cursor": "#e6edf3",
    "water": "#131d26",
    "plan": "#3a4a58",
    "shared": "#93a1ad",
}


@contextmanager
def figure(path: Path | BytesIO, width: float, height: float) -> Iterator["Picture"]:
    """A context with an empty figure in the common style, which is saved at its end.

    `path`: the file, whose suffix is the format, or where PNG is written to. `width`: in inches. `height`: in inches.
    """
    import matplotlib as mpl  # imported here: it takes longer than simulating a minute
    from matplotlib.figure import Figure as Picture

    with mpl.rc_context(PLOT):
        picture = Picture(figsize=(width, height), layout="constrained")
        yield picture
        picture.savefig(path)


def run_colour(run: int | None) -> str:
    """The style sheet's colour of a run among several, by its index; the neutral colour of shared lines for None."""
    return "--shared" if run is None else f"--run-{run % len(SERIES)}"


def look(run: int | None, role: str, alone: bool) -> dict[str, Any]:
    """Colour, width and dashes of a line; its colour is that of its role in a single run, of its run in several."""
    colour, width, dash = ROLES[role]
    return {"colour": colour if alone else run_colour(run), "width": width, "dash": dash}


def css_variables() -> str:
    """The palette as CSS custom properties, for a light and a dark page."""
    light = _variables("light", SERIES, _LIGHT_PAGE)
    dark = _variables("dark", DARK_SERIES, _DARK_PAGE)
    return (
        f":root {{ {light} }}\n"
        f':root[data-theme="dark"] {{ {dark} }}\n'
        f'@media (prefers-color-scheme: dark) {{ :root:not([data-theme="light"]) {{ {dark} }} }}\n'
    )


def _variables(scheme: str, series: tuple[str, ...], page: dict[str, str]) -> str:
    properties = " ".join(f"--{name}: {colour};" for name, colour in _colours(series, page).items())
    return f"color-scheme: {scheme}; {properties}"


def _colours(series: tuple[str, ...], page: dict[str, str]) -> dict[str, str]:
    roles = dict(zip(("ship", "reference", "other", "third"), series, strict=False))
    return {**page, **roles, **{f"run-{i}": colour for i, colour in enumerate(series)}}


def page_colour(name: str) -> str:
    """A colour of the style sheet on a light page, such as --limit, or --run-0/0.2 with an opacity, for matplotlib."""
    variable, _, opacity = name.removeprefix("--").partition("/")
    return _colours(SERIES, _LIGHT_PAGE)[variable] + (f"{round(255.0 * float(opacity)):02x}" if opacity else "")


Figure = dict[str, Any]  # title, traces and layout
DIGITS = 5  # significant digits of the drawn numbers
POINTS = 1500  # approximate number of points of a line
COLUMNS, SIZE = 2, (5.2, 3.8)  # of a picture: diagrams side by side; width and height of each, inches
TITLE_WIDTH = 44  # longest line of the title of a diagram in a picture, characters
CHARACTERS = 12  # of the name of an ordinate, per inch
DASHES = {"solid": "-", "dash": "--", "dot": ":", "dashdot": "-."}
LOGARITHMIC_RATIO = 30.0  # ratio of the largest to the smallest value from which on a scale is logarithmic
SYMBOLS = {"cross": "P", "x": "X", "square": "s", "diamond": "D", "star": "*"}
COLOUR_MAP = "viridis_r"  # Viridis reversed, of matplotlib
PIXEL = 0.75  # size of a pixel of a page, points


class Axis(NamedTuple):
    """A quantity that is drawn: its name with the unit, whether its scale is logarithmic, and names of 0, 1, 2, ... on it."""

    name: str
    logarithmic: bool = False
    ticks: tuple[str, ...] = ()


def layout(x: Axis, y: Axis, height: int = 330, legend: bool = False) -> Figure:
    """The layout of a diagram of a height in pixels."""

    def axis(of: Axis) -> Figure:
        kind: Figure = {"type": "log", "dtick": 1} if of.logarithmic else {}
        if of.ticks:
            kind = {"tickvals": [*range(len(of.ticks))], "ticktext": [*of.ticks]}
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


def signal(time: Array, values: Array, name: str, colour: str, **look: Any) -> Figure:
    """A line over time, decimated to the minimum and the maximum of each bucket of samples, so that no peak is lost."""
    chosen = buckets(len(time), POINTS)
    return line(thin_time(time, chosen), thin(np.asarray(values, float), chosen), name, colour, **look)


class Buckets(NamedTuple):
    """A partition of samples."""

    samples: int  # number of samples, n
    size: int  # samples per bucket; 1 keeps every sample

    @property
    def number(self) -> int:
        """Number of buckets, m; the last one may be shorter."""
        return -(-self.samples // self.size)


def buckets(samples: int, limit: int) -> Buckets:
    """Choose the smallest buckets that reduce samples to at most `limit` values, two for each bucket."""
    return Buckets(samples, 1 if samples <= limit else -(-samples // (limit // 2)))


def thin_time(time: Array, chosen: Buckets) -> Array:
    """Times of the values of `thin`: start and middle of each bucket, (2 m,); all times for buckets of one sample."""
    if chosen.size == 1:
        return time
    starts = np.arange(chosen.number) * chosen.size
    middles = np.minimum(starts + chosen.size // 2, chosen.samples - 1)
    picked: Array = time[np.column_stack((starts, middles)).ravel()]
    return picked


def thin(values: Array, chosen: Buckets) -> Array:
    """Minimum and maximum of each bucket in the order in which they occur, (2 m,); all values for buckets of one sample.

    NaN is returned only for buckets that contain nothing else. `values`: (n,).
    """
    if chosen.size == 1:
        return values
    # The last bucket is filled up with NaN, which the masked argmin and argmax below ignore.
    padded = np.full(chosen.number * chosen.size, np.nan)
    padded[: chosen.samples] = values
    rows = padded.reshape(chosen.number, chosen.size)
    unknown = np.isnan(rows)
    least = np.argmin(np.where(unknown, np.inf, rows), axis=1)
    greatest = np.argmax(np.where(unknown, -np.inf, rows), axis=1)
    # In their order in time, so that a line through them does not reverse a slope.
    picks = np.column_stack((np.minimum(least, greatest), np.maximum(least, greatest)))
    extremes: Array = np.take_along_axis(rows, picks, axis=1).ravel()
    return extremes


def points(x: Array, y: Array, name: str, colour: str, symbol: str = "circle", size: float = 6.0) -> Figure:
    """Points of one colour; without a name they have no entry in the legend."""
    marker = {"color": colour, "symbol": symbol, "size": size, "line": {"color": "--card", "width": 0.8 * (size > 6.0)}}
    return {**line(x, y, name, colour, "markers"), "x": numbers(x), "y": numbers(y), "marker": marker}


def histogram(values: Array, bins: int, colour: str) -> Figure:
    """Counts of values as bars."""
    counts, edges = np.histogram(values, bins)
    middles = numbers(0.5 * (edges[1:] + edges[:-1]))
    return {"type": "bar", "x": middles, "y": counts.tolist(), "width": float(edges[1] - edges[0]), "marker": {"color": colour}}


def text(x: float, y: float, words: str, **look: Any) -> Figure:
    """A text at a place, one of the `annotations` of a layout; `look` as Plotly names it, such as xref and yref."""
    return {"x": x, "y": y, "text": words, "showarrow": False, **look}


def level(y: float, colour: str = "--limit", dash: str = "dash", name: str = "") -> Figure:
    """A dashed line at a value of the ordinate, one of the `shapes` of a layout; with a name it has an entry in the legend."""
    drawn = {"color": colour, "width": 1.2, "dash": dash}
    return {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": y, "y1": y, "line": drawn, "name": name}


def moment(x: float, colour: str = "--limit", dash: str = "dash", name: str = "") -> Figure:
    """A dashed line at a value of the abscissa, as `level`."""
    drawn = {"color": colour, "width": 1.2, "dash": dash}
    return {"type": "line", "yref": "paper", "y0": 0, "y1": 1, "x0": x, "x1": x, "line": drawn, "name": name}


def numbers(values: Array) -> list[float | None]:
    """Numbers for JSON, which has none that is not finite; with more digits where they differ little, such as far from zero."""
    values = np.asarray(values, float)
    finite = values[np.isfinite(values)]
    spread = float(np.ptp(finite)) if len(finite) else 0.0
    digits = DIGITS + max(0, math.floor(math.log10(np.abs(finite).max() / spread))) if spread > 0.0 else 15
    return [float(f"{value:.{digits}g}") if math.isfinite(value) else None for value in values.tolist()]


def spans(values: Array) -> bool:
    """Whether positive values span so much that a linear scale would hide the small ones."""
    finite = values[np.isfinite(values)]
    return bool(len(finite)) and bool(finite.min() > 0.0) and bool(finite.max() / finite.min() > LOGARITHMIC_RATIO)


def draw(path: Path, figures: Sequence[Figure], size: tuple[float, float] = SIZE, stacked: bool = False) -> Path:
    """Draw figures into a picture, whose format is the suffix of its path. Raises OSError if it cannot be written.

    `size`: width and height of each figure, inches. `stacked`: whether they are below each other over a common abscissa, else
    they are side by side.
    """
    columns = 1 if stacked else min(COLUMNS, len(figures))
    rows = -(-len(figures) // columns)
    with figure(path, size[0] * columns, size[1] * rows) as picture:
        panels = picture.subplots(rows, columns, squeeze=False, sharex=stacked).ravel()
        for panel, each in zip(panels, figures, strict=False):
            _draw(panel, each)
            _set_axes(panel, each, round(CHARACTERS * size[1]))
            _add_legend(panel, each, stacked)
            if stacked:
                panel.label_outer()
        for panel in panels[len(figures) :]:
            panel.remove()
    return path


def _draw(panel: "Axes", drawn: Figure) -> None:
    below: Any = []  # the line that a filled area reaches down to
    shaded: Any = None  # the points and the scale of their colours
    for trace in drawn["traces"]:
        x, y = trace["x"], trace["y"]
        if trace["type"] == "bar":
            _draw_bars(panel, trace)
        elif trace["type"] == "heatmap":
            ends = {"vmin": trace["zmin"], "vmax": trace["zmax"]}
            shaded = panel.pcolormesh(x, y, np.array(trace["z"], float), cmap=COLOUR_MAP, **ends), trace["colorbar"]
        elif trace["mode"] == "markers":
            shaded = _draw_points(panel, np.array(x, float), np.array(y, float), trace) or shaded
        else:
            _draw_line(panel, trace, below)
        below = y
    for shape in drawn["layout"].get("shapes", ()):
        mark, at = (panel.axhline, shape["y0"]) if shape.get("xref") == "paper" else (panel.axvline, shape["x0"])
        mark(at, label=shape["name"], **_stroke(shape["line"]))
    for note in drawn["layout"]["annotations"]:
        _annotate(panel, note)
    if shaded is not None:
        points, bar = shaded
        scale = panel.figure.colorbar(points, ax=panel, label=bar["title"]["text"])
        if "tickvals" in bar:
            scale.set_ticks(bar["tickvals"], labels=bar["ticktext"])


def _stroke(pen: Figure) -> dict[str, Any]:
    """Colour, width and dashes of a line for matplotlib."""
    dash = pen["dash"]
    dashes = (0.0, [PIXEL * float(part.removesuffix("px")) for part in dash.split(",")]) if "px" in dash else DASHES[dash]
    return {"color": page_colour(pen["color"]), "lw": PIXEL * pen["width"], "ls": dashes}


def _annotate(panel: "Axes", note: Figure) -> None:
    """Write a text, with an arrow to its place if it has one; texts that are in units of one axis only are left out."""
    if note.get("xref") != note.get("yref"):
        return
    at: Any = "axes fraction" if "xref" in note else "data"
    place, text = (note["x"], note["y"]), note["text"]
    if note["showarrow"]:
        arrow: Any = {"arrowstyle": "-|>", "color": page_colour(note["arrowcolor"]), "lw": 2.0}
        tail = PIXEL * note["ax"], -PIXEL * note["ay"]
        panel.annotate(text, place, tail, at, "offset points", arrowprops=arrow)
        return
    colour = page_colour(note.get("font", {}).get("color", "--ink"))
    sides: Any = {"ha": note.get("xanchor", "center"), "va": note.get("yanchor", "middle").replace("middle", "center")}
    box: Any = {"boxstyle": "round,pad=0.15", "fc": page_colour(note["bgcolor"]), "ec": "none"} if "bgcolor" in note else None
    panel.annotate(text, place, xycoords=at, color=colour, fontsize=8, bbox=box, **sides)


def _draw_bars(panel: "Axes", trace: Figure) -> None:
    colour = page_colour(trace["marker"]["color"])
    if trace.get("orientation") == "h":
        spread = {"xerr": trace["error_x"]["array"], "error_kw": {"ecolor": page_colour("--shared"), "capsize": 2}}
        panel.barh(trace["y"], trace["x"], color=colour, **spread)
    else:
        panel.bar(trace["x"], trace["y"], trace["width"], color=colour)


def _draw_line(panel: "Axes", trace: Figure, below: Any) -> None:
    """Draw a line, or the area between it and the one before."""
    x, y, pen = trace["x"], trace["y"], trace["line"]
    if "fill" in trace:
        step: Any = "post" if pen["shape"] == "hv" else None
        panel.fill_between(x, below, y, color=page_colour(trace["fillcolor"]), lw=0, step=step, label=trace["name"])
    elif pen["width"]:
        style: Any = {"drawstyle": "steps-post" if pen["shape"] == "hv" else "default", "label": trace["name"], **_stroke(pen)}
        panel.plot(np.array(x, float), np.array(y, float), marker="o" if "markers" in trace["mode"] else "", ms=4, **style)


def _draw_points(panel: "Axes", x: Array, y: Array, trace: Figure) -> Any:
    """Draw points; returns them with the bar of their colours, None if they have one colour."""
    marker = trace["marker"]
    if "angle" in marker:  # arrows, clockwise from up
        angle = np.radians(marker["angle"])
        panel.quiver(x, y, np.sin(angle), np.cos(angle), color=page_colour(marker["color"]), width=0.004, scale=22, zorder=3)
        return None
    style: Any = {"marker": SYMBOLS.get(marker["symbol"], "o"), "s": (PIXEL * marker["size"]) ** 2, "label": trace.get("name")}
    style |= {"linewidths": PIXEL * marker["line"]["width"], "edgecolors": page_colour(marker["line"]["color"])}
    if isinstance(marker["color"], str):
        panel.scatter(x, y, color=page_colour(marker["color"]), zorder=3, **style)
        return None
    shade = {"c": np.array(marker["color"], float), "vmin": marker["cmin"], "vmax": marker["cmax"], "cmap": COLOUR_MAP}
    return panel.scatter(x, y, **shade, **style), marker["colorbar"]


def _add_legend(panel: "Axes", drawn: Figure, above: bool) -> None:
    """Add a legend where a line or a limit needs one: in the panel, or above it, where it covers no line."""
    if drawn["layout"]["showlegend"] or any(shape["name"] for shape in drawn["layout"].get("shapes", ())):
        place: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.97), "ncols": 6, "fontsize": 7, "borderaxespad": 0.0}
        panel.legend(**(place if above else {"loc": "best"}))


def _set_axes(panel: "Axes", drawn: Figure, width: int) -> None:
    """Names, scales and ranges of the axes, and the title where it is not the name of an axis.

    `width`: longest line of the name of the ordinate, characters.
    """
    across, up = drawn["layout"]["xaxis"], drawn["layout"]["yaxis"]
    panel.set(xlabel=across["title"]["text"], ylabel=textwrap.fill(up["title"]["text"], width))
    if drawn["title"] not in (across["title"]["text"], up["title"]["text"]):
        panel.set_title(textwrap.fill(drawn["title"], TITLE_WIDTH))
    for axis, set_scale, set_limits, set_ticks in (
        (across, panel.set_xscale, panel.set_xlim, panel.set_xticks),
        (up, panel.set_yscale, panel.set_ylim, panel.set_yticks),
    ):
        logarithmic = axis.get("type") == "log"
        if logarithmic:
            set_scale("log")
        if "tickvals" in axis:
            set_ticks(axis["tickvals"], labels=axis["ticktext"])
        if "range" in axis:
            set_limits(*(10.0**end if logarithmic else end for end in axis["range"]))
    if "scaleanchor" in up:
        panel.set_aspect("equal", adjustable="box" if "range" in up else "datalim")
