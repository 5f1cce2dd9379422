"""The page of one or several runs: one HTML file that needs nothing but itself."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from vessel_hsmc_ros.exceptions import ReportError
from vessel_hsmc_ros.report.panels import DESIRED, Line, Panel, panels
from vessel_hsmc_ros.report.payload import Payload, packed
from vessel_hsmc_ros.report.tables import Record, key_figures, parameter_tables, provenance_table
from vessel_hsmc_ros.schema import parameter

SCRIPTS = ("data.js", "clock.js", "chart.js", "track.js", "map.js", "main.js")
LINE_VALUES, PAGE_VALUES = 20_000, 2_000_000
"""Values of one line, and of all lines of a page, that are carried at most: 4 bytes each before compression."""

COLOURS = 6
_ROLE_COLOURS = {"main": "--ship", "desired": "--reference", "other": "--other"}


@dataclass(frozen=True)
class Hull:
    """The ship's outline on the page; the model has no size.

    32 m is the length of the ship that these coefficients are known for in the literature, of 118 t; the beam is ours.
    """

    length: float = parameter(32.0, "Length of the hull that is drawn.", unit="m", low=0.1, high=1000.0)
    beam: float = parameter(8.0, "Beam of the hull that is drawn.", unit="m", low=0.1, high=1000.0)


def write(path: Path, records: Sequence[Record], title: str, hull: Hull | None = None) -> None:
    """Write the page of some runs.

    Raises:
        ReportError: the file cannot be written.
    """
    page = render(records, title, hull or Hull())
    try:
        path.write_text(page, encoding="utf-8")
    except OSError as error:
        raise ReportError(f"report {path} cannot be written: {error.strerror}") from None


def render(records: Sequence[Record], title: str, hull: Hull) -> str:
    """The text of the page of some runs, at least one."""
    merged = _merge(records)
    lines = sum(len(panel.lines) for panel, _ in merged)
    payload = Payload(max(2000, min(LINE_VALUES, PAGE_VALUES // max(1, lines))))
    drawn = [_panel(payload, panel, owners, records) for panel, owners in merged]
    tracks = [track for i, record in enumerate(records) for track in _tracks(payload, record, i, len(records))]
    content = {
        "begin": min(float(record.signals.state.time[0]) for record in records),
        "end": max(float(record.signals.state.time[-1]) for record in records),
        "hull": {"length": hull.length, "beam": hull.beam},
        "panels": drawn,
        "tracks": tracks,
    }
    return _template().render(
        title=title,
        subtitle=_subtitle(records),
        names=[record.name for record in records],
        tracks=tracks,
        hull=hull,
        groups=_groups(merged),
        figures=key_figures(records),
        parameters=parameter_tables(records),
        provenance=provenance_table(records),
        resolution=_resolution(drawn, records),
        style=_asset("style.css"),
        script="\n".join(_asset(name) for name in SCRIPTS),
        content=json.dumps(content, separators=(",", ":")).replace("<", "\\u003c"),
        numbers=payload.text(),
        library=_library(),
    )


def _asset(name: str) -> str:
    return resources.files("vessel_hsmc_ros.report").joinpath("assets", name).read_text(encoding="utf-8")


@cache
def _library() -> str:
    """Plotly's own file, compressed; read without importing its Python half, which the page has no use for."""
    return packed(resources.files("plotly").joinpath("package_data", "plotly.min.js").read_bytes())


def _template() -> jinja2.Template:
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.from_string(_asset("page.html"))


def _merge(records: Sequence[Record]) -> list[tuple[Panel, list[int | None]]]:
    """The panels of all runs, those of one title in one, and whose each line is: None for one that all share."""
    merged: dict[tuple[str, str], tuple[Panel, list[Line], list[int | None]]] = {}
    for i, record in enumerate(records):
        for panel in panels(record.signals, record.limits):
            _, lines, owners = merged.setdefault((panel.group, panel.title), (panel, [], []))
            for line in panel.lines:
                if (same := _index_of_equal(line, lines)) is None:
                    lines.append(line)
                    owners.append(i)
                else:
                    owners[same] = None
    return [(Panel(p.group, p.title, p.unit, tuple(lines), p.limits, p.step), owners) for p, lines, owners in merged.values()]


def _index_of_equal(line: Line, lines: Sequence[Line]) -> int | None:
    """Which of the lines is the same reference or truth as another run's, if any."""
    for i, other in enumerate(lines):
        if line.role == other.role == DESIRED and np.array_equal(line.values, other.values):
            return i
    return None


def _panel(payload: Payload, panel: Panel, owners: Sequence[int | None], records: Sequence[Record]) -> dict[str, Any]:
    """A panel as the page takes it, every line with its label and colour."""
    drawn = payload.panel(panel)
    for line, owner in zip(drawn["lines"], owners, strict=True):
        if len(records) == 1:
            line["label"], line["colour"] = line["name"], _ROLE_COLOURS[line["role"]]
        elif owner is None:
            line["label"], line["colour"] = line["name"], "--shared"
        else:
            line["label"] = f"{records[owner].name}: {line['name']}" if len(panel.lines) > len(records) else records[owner].name
            line["colour"] = f"--run-{owner % COLOURS}"
    return drawn


def _tracks(payload: Payload, record: Record, index: int, runs: int) -> list[dict[str, Any]]:
    """Ship and reference of a run as the map takes them."""
    signals = record.signals
    tracks = []
    if signals.reference is not None:
        colour = "--reference" if runs == 1 else f"--run-{index % COLOURS}"
        label = "reference" if runs == 1 else f"{record.name}: reference"
        tracks.append({**payload.poses(signals.reference), "role": "reference", "label": label, "colour": colour})
    colour = "--ship" if runs == 1 else f"--run-{index % COLOURS}"
    label = "ship" if runs == 1 else record.name
    tracks.append({**payload.poses(signals.state), "role": "ship", "label": label, "colour": colour})
    return tracks[::-1]


def _groups(merged: Sequence[tuple[Panel, list[int | None]]]) -> list[dict[str, Any]]:
    groups: dict[str, list[dict[str, Any]]] = {}
    for i, (panel, _) in enumerate(merged):
        groups.setdefault(panel.group, []).append({"index": i, "title": panel.title, "unit": panel.unit})
    return [{"name": name, "panels": found} for name, found in groups.items()]


def _subtitle(records: Sequence[Record]) -> str:
    """How long, and which law."""
    words = [f"{max(record.signals.duration for record in records):g} s"]
    laws = dict.fromkeys(record.scenario.controller.law for record in records if record.scenario)
    if laws:
        words.append("law " + ", ".join(laws))
    if len(records) > 1:
        words.insert(0, f"{len(records)} runs")
    return " · ".join(words)


def _resolution(drawn: Sequence[dict[str, Any]], records: Sequence[Record]) -> str:
    """What the page carries of the samples, in words."""
    size = max((line["bucket"] for panel in drawn for line in panel["lines"]), default=1)
    if size == 1:
        return "The diagrams carry every sample."
    time = records[0].signals.state.time
    period = float(np.median(np.diff(time[:1000])))
    return (
        f"The diagrams carry the least and the greatest of every {size} samples ({size * period:.3g} s),"
        " so that no peak is lost; the bag has them all."
    )
