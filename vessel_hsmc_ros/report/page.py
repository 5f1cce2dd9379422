"""The page of one or several runs: one HTML file that needs nothing but itself."""

import json
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.hull import Hull
from vessel_hsmc_ros.report import jitter
from vessel_hsmc_ros.report.overlay import REFERENCE, Overlay, Track, overlays, tracks
from vessel_hsmc_ros.report.panels import DESIRED, MAIN
from vessel_hsmc_ros.report.payload import Payload, packed
from vessel_hsmc_ros.report.tables import Record, key_figures, parameter_tables, provenance_table

SCRIPTS = ("data.js", "clock.js", "chart.js", "track.js", "map.js", "main.js")
LINE_VALUES, PAGE_VALUES = 50_000, 3_000_000
"""Values of one line, and of all lines of a page, that are carried at most: 4 bytes each, were there no compression."""

COLOURS = 6
_ROLE_COLOURS = {"main": "--ship", "desired": "--reference", "other": "--other", "third": "--third", "measured": "--shared"}


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
    found, alone = overlays(records), len(records) == 1
    lines = sum(len(overlay.lines) for overlay in found)
    payload = Payload(max(2000, min(LINE_VALUES, PAGE_VALUES // max(1, lines))))
    drawn = [_panel(payload, overlay, alone) for overlay in found]
    sailed = [_track(payload, track, alone) for track in tracks(records)]
    content = {
        "begin": min(float(record.signals.state.time[0]) for record in records),
        "end": max(float(record.signals.state.time[-1]) for record in records),
        "hull": {"length": hull.length, "beam": hull.beam},
        "panels": drawn,
        "tracks": sailed,
    }
    return _template().render(
        title=title,
        subtitle=_subtitle(records),
        names=[record.name for record in records],
        tracks=sailed,
        hull=hull,
        groups=_groups(found),
        jitter=jitter.picture(records),
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


def _panel(payload: Payload, overlay: Overlay, alone: bool) -> dict[str, Any]:
    """A panel as the page takes it, every line with its label and colour."""
    panel = overlay.panel
    lines = [
        {**payload.line(owned.line), "label": owned.label, "colour": _colour(owned.run, owned.line.role, alone)}
        for owned in overlay.lines
    ]
    return {"title": panel.title, "unit": panel.unit, "limits": list(panel.limits), "step": panel.step, "lines": lines}


def _track(payload: Payload, track: Track, alone: bool) -> dict[str, Any]:
    """A ship or a reference as the map takes it."""
    colour = _colour(track.run, DESIRED if track.role == REFERENCE else MAIN, alone)
    return {**payload.poses(track.poses), "role": track.role, "label": track.label, "colour": colour}


def _colour(run: int | None, role: str, alone: bool) -> str:
    """The style sheet's name of a colour: by role where there is one run, else by run."""
    if alone:
        return _ROLE_COLOURS[role]
    return "--shared" if run is None else f"--run-{run % COLOURS}"


def _groups(found: Sequence[Overlay]) -> list[dict[str, Any]]:
    groups: dict[str, list[dict[str, Any]]] = {}
    for i, overlay in enumerate(found):
        panel = overlay.panel
        groups.setdefault(panel.group, []).append({"index": i, "title": panel.title, "unit": panel.unit})
    return [{"name": name, "panels": panels} for name, panels in groups.items()]


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
