"""The kit of all pages: one Jinja environment, the page that all extend, their style, scripts, numbers and origin."""

import base64
import datetime
import json
import shlex
import sys
import zlib
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.report.diagrams import Buckets, Figure, buckets, css_variables, thin, thin_time
from vessel_hsmc_ros.report.panels import Line
from vessel_hsmc_ros.scenario.run_folder import provenance

COMMAND = "vessel-hsmc"

DIAGRAM_SCRIPTS = ("data.js", "theme.js", "diagram.js", "figures.js")
"""Scripts of a page whose diagrams are complete figures of Plotly."""


class Section(NamedTuple):
    """A part of a page of sections."""

    title: str
    text: str = ""  # a paragraph below it; empty for none
    # head, lines: a table; without lines there is none
    head: Sequence[str] = ()
    lines: Sequence[Sequence[str]] = ()
    texts: int = 1  # how many columns of the table on the left are text; the others are numbers
    prose: bool = False  # whether the last column is text too
    marked: Collection[str] = ()  # first cells of the lines that are emphasised
    figures: Sequence[Figure] = ()  # diagrams


def render(template: str, title: str, about: Sequence[str], *, scripts: Sequence[str], content: Any = None, **values: Any) -> str:
    """Render the HTML text of a page that extends `report/base.html`.

    `template`: the room and the file of its template, such as `report/page.html`. `scripts`: the files of its scripts, those of
    another room as `room/file`. `content`: what the scripts find as JSON in the element `content`; None for a page without
    diagrams.
    """
    return (
        _environment()
        .get_template(template)
        .render(
            title=title,
            about=about,
            origin=origin(),
            style=css_variables() + asset("report/style.css"),
            script="\n".join(asset(name if "/" in name else f"report/{name}") for name in scripts),
            # "<" escaped: a name that contains "</script>" would end the script element.
            content="" if content is None else json.dumps(content, separators=(",", ":")).replace("<", "\\u003c"),
            library="" if content is None else library(),
            **values,
        )
    )


def render_sections(title: str, about: Sequence[str], sections: Sequence[Section], findings: Sequence[str] = ()) -> str:
    """Render a page of diagrams and tables.

    `findings`: sentences that stand before them: verdicts, warnings.
    """
    drawn = any(section.figures for section in sections)
    scripts = (*DIAGRAM_SCRIPTS, "sections.js") if drawn else ("theme.js", "static.js")
    content = {"figures": [section.figures for section in sections]} if drawn else None
    values: dict[str, Any] = {"sections": sections, "findings": findings, "drawn": drawn}
    return render("report/sections.html", title, about, scripts=scripts, content=content, **values)


@contextmanager
def writing(what: str) -> Iterator[None]:
    """A context in which files are written. Raises ReportError, which names them, if one cannot be."""
    try:
        yield
    except OSError as error:
        raise ReportError(f"{what} cannot be written: {error.strerror}") from None


def asset(name: str) -> str:
    """A file of a page, named by its room: a template, a style, a script."""
    room, _, file = name.rpartition("/")
    return (resources.files("vessel_hsmc_ros") / room / "assets" / file).read_text(encoding="utf-8")


@cache
def library() -> str:
    """Plotly's JavaScript, compressed; read as a file because importing its Python package takes long and is not needed."""
    return packed((resources.files("plotly") / "package_data" / "plotly.min.js").read_bytes())


@cache
def _environment() -> jinja2.Environment:
    # StrictUndefined: a misspelt name in the template is an error instead of an empty text.
    return jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, loader=jinja2.FunctionLoader(asset))


def origin() -> str:
    """Version, commit and date of the page, and the command that made it."""
    code = provenance()
    now = datetime.datetime.now(tz=datetime.timezone.utc)
    program, *arguments = sys.argv or [""]
    command = shlex.join([COMMAND, *arguments]) if Path(program).name == COMMAND else "the Python API"
    commit = f"commit {code['git_commit']}" if code["git_commit"] else "no git checkout"
    return f"vessel_hsmc_ros {code['version']} · {commit} · {now:%Y-%m-%d %H:%M} UTC · made by {command}"


Array = NDArray[np.float64]

TRACK_POINTS = 20_000  # largest number of poses of a track; the page interpolates between them


def packed(text: bytes) -> str:
    """Compress with zlib and encode in base64."""
    return base64.b64encode(zlib.compress(text, 6)).decode("ascii")


class Payload:
    """Collects the arrays of a page, thinned; a time axis that several lines share is stored once.

    `limit`: largest number of values of one line.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._parts: list[bytes] = []
        self._length = 0
        self._times: dict[int, tuple[Array, Buckets, dict[str, Any]]] = {}

    def text(self) -> str:
        """All arrays that were added, compressed."""
        return packed(b"".join(self._parts))

    def add(self, values: Array, kind: str = "f4") -> dict[str, Any]:
        """Add an array.

        `values`: (n,). Returns offset in bytes, count and type, for the page's `unpack`.
        """
        with np.errstate(over="ignore"):  # a diverged run may exceed the range of 32-bit floats
            raw = np.ascontiguousarray(values).astype("<" + kind)
        where = {"at": self._length, "count": len(raw), "kind": kind}
        # Byte shuffling: with bytes of equal significance next to each other, smooth series compress to half the size.
        self._parts.append(raw.view(np.uint8).reshape(len(raw), -1).T.tobytes())
        self._length += raw.nbytes
        return where

    def line(self, line: Line) -> dict[str, Any]:
        """Add one line of a panel, thinned to extremes."""
        chosen, time = self._time(line.time)
        values = self.add(thin(np.asarray(line.values, dtype=float), chosen))
        return {"time": time, "values": values, "bucket": chosen.size}

    def poses(self, time: Array, poses: Array) -> dict[str, Any]:
        """Add a track: positions relative to their centre, so that 32 bits are sufficient, and the unwrapped heading.

        `time`: (n,), s. `poses`: x, y, psi and more, (n, 3) or wider.
        """
        picks = np.unique(np.linspace(0, len(time) - 1, min(len(time), TRACK_POINTS)).astype(int))
        x, y, psi = poses[picks, :3].T
        middle = [float(np.nan_to_num(0.5 * (np.nanmin(axis) + np.nanmax(axis)))) for axis in (x, y)]
        return {
            "time": self.add(time[picks], "f8"),
            "x": self.add(x - middle[0]),
            "y": self.add(y - middle[1]),
            "heading": self.add(np.unwrap(psi)),
            "middle": middle,
        }

    def points(self, points: NDArray[np.complex128]) -> dict[str, Any]:
        """Add positions x + i·y, relative to their centre."""
        middle = [float(0.5 * (axis.min() + axis.max())) for axis in (points.real, points.imag)]
        return {"x": self.add(points.real - middle[0]), "y": self.add(points.imag - middle[1]), "middle": middle}

    def _time(self, time: Array) -> tuple[Buckets, dict[str, Any]]:
        """The buckets of a time axis and its place; most lines share a few."""
        # By identity: arrays of a run share one time axis. It is kept alive here, so that its id cannot be reused.
        if id(time) not in self._times:
            chosen = buckets(len(time), self._limit)
            self._times[id(time)] = time, chosen, self.add(thin_time(time, chosen), "f8")
        _, chosen, where = self._times[id(time)]
        return chosen, where
