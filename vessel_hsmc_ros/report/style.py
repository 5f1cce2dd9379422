"""The common palette and plot style of pages, figures and the figures of the paper.

The line colours are Okabe and Ito's, which remain distinct in colour blindness, green and purple darkened for contrast on white.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SERIES = ("#0072b2", "#d55e00", "#00875f", "#b0478a", "#8a6d00", "#4b4bc8")
"""Blue, vermilion, green, purple, olive, indigo: the colours of lines, or of runs, in this order."""

SHIP, REFERENCE, OTHER, THIRD = SERIES[:4]
NEUTRAL, LIMIT, INK = "#6b7782", "#b3261e", "#17212b"
"""Shared or measured quantities, saturation limits, and nearly black for what is true by definition."""

PLANNED = "#c4d3de"
"""Planned legs, below the tracks."""

DARK_SERIES = ("#56b4e9", "#f08c3a", "#3ccf9a", "#e58fc3", "#e0c14a", "#9d9dfb")
"""The same hues on a dark page."""

ROLE_COLOURS = {"main": "--ship", "desired": "--reference", "other": "--other", "third": "--third", "measured": "--shared"}
"""Colour of a line of a single run by its role in a panel."""

PLOT: Any = {
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
    "plan": PLANNED,
    "shared": NEUTRAL,
    "picture": "none",
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
    "picture": "invert(0.9) hue-rotate(180deg)",  # a figure on white becomes one on black, of the same hues
}


@contextmanager
def figure(path: Path | BytesIO, width: float, height: float) -> Iterator["Figure"]:
    """A context with an empty figure in the common style, which is saved at its end.

    `path`: the file, whose suffix is the format, or where PNG is written to. `width`: in inches. `height`: in inches.
    """
    import matplotlib as mpl  # imported here: it takes longer than simulating a minute
    from matplotlib.figure import Figure

    with mpl.rc_context(PLOT):
        picture = Figure(figsize=(width, height), layout="constrained")
        yield picture
        picture.savefig(path)


def run_colour(run: int | None) -> str:
    """The style sheet's colour of a run among several, by its index; the neutral colour of shared lines for None."""
    return "--shared" if run is None else f"--run-{run % len(SERIES)}"


def line_colour(run: int | None, role: str, alone: bool) -> str:
    """The style sheet's colour of a line: by its role where there is a single run, by its run where there are several."""
    return ROLE_COLOURS[role] if alone else run_colour(run)


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
