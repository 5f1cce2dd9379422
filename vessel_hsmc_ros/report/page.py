"""The page of one or several runs: a single HTML file without external resources."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vessel_hsmc_ros.core.hull import Hull, described
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.report import page_kit
from vessel_hsmc_ros.report.diagrams import SERIES, line_colour, run_colour
from vessel_hsmc_ros.report.figures import jitter_picture
from vessel_hsmc_ros.report.page_kit import Payload
from vessel_hsmc_ros.report.panels import (
    DESIRED,
    MAIN,
    REFERENCE,
    Overlay,
    Plan,
    Stops,
    Track,
    fences,
    overlays,
    plans,
    stops,
    tracks,
)
from vessel_hsmc_ros.report.record import Record, leg_rows
from vessel_hsmc_ros.report.tables import metrics_table, parameter_tables, provenance_table

SCRIPTS = (
    "units.js",
    "data.js",
    "clock.js",
    "export.js",
    "legend.js",
    "marks.js",
    "chart.js",
    "track.js",
    "map.js",
    "theme.js",
    "main.js",
)
LINE_VALUES, PAGE_VALUES = 50_000, 3_000_000
"""Largest number of values of one line, and of all lines of a page; 4 bytes each before compression."""

NARROW_RUNS = 3
"""Largest number of runs whose metrics are shown beside the map; the table of more runs has the width of the page."""


def write(path: Path, records: Sequence[Record], title: str, hull: Hull | None = None, notes: Sequence[str] = ()) -> None:
    """Write the page of some runs.

    `records`: at least one run; the others are compared with the first. `hull`: dimensions of the ship that is drawn; None for
    those of the first run's scenario. `notes`: paragraphs below the headline. Raises ReportError if the file cannot be written.
    """
    page = render(records, title, hull or hull_of(records), notes)
    with page_kit.writing(f"report {path}"):
        path.write_text(page, encoding="utf-8")


def hull_of(records: Sequence[Record]) -> Hull:
    """The hull of the first run's ship; that of the paper where its scenario is not known."""
    scenario = records[0].scenario
    return scenario.vessel_sim.vessel if scenario else Hull()


def render(records: Sequence[Record], title: str, hull: Hull, notes: Sequence[str] = ()) -> str:
    """Render the HTML text of a page; for the arguments see `write`."""
    overlaid = overlays(records)
    content, numbers = _content(records, overlaid, hull)
    return page_kit.render(
        "report/page.html",
        title,
        [_subtitle(records)],
        scripts=SCRIPTS,
        content=content,
        notes=notes,
        names=[record.name for record in records],
        colours=len(SERIES),
        wide=len(records) > NARROW_RUNS,
        tracks=content["tracks"],
        planned=bool(content["plans"]),
        fenced=bool(content["fences"]),
        legs=_legs(records),
        hull=hull,
        groups=_groups(overlaid),
        verdicts=_verdicts(records),
        marks=content["marks"],
        jitter=jitter_picture(records),
        metrics=metrics_table(records),
        compared=not of_one_fleet(records),
        parameters=parameter_tables(records),
        provenance=provenance_table(records),
        resolution=_resolution(content["panels"], records),
        numbers=numbers,
    )


def of_one_fleet(records: Sequence[Record]) -> bool:
    """Whether the records are of the vessels of one bag, of which none is the standard of the others."""
    bags = {record.provenance.get("bag") for record in records}
    names = {record.provenance.get("namespace") for record in records}
    return len(bags) == 1 and len(names) == len(records) > 1


def _content(records: Sequence[Record], overlaid: Sequence[Overlay], hull: Hull) -> tuple[dict[str, Any], str]:
    """Diagrams and tracks for the scripts of the page, and the compressed numbers to which they refer."""
    alone = len(records) == 1
    lines = sum(len(overlay.lines) for overlay in overlaid)
    # Many runs share the budget of the page, but each line keeps enough values for its shape.
    payload = Payload(max(2000, min(LINE_VALUES, PAGE_VALUES // max(1, lines))))
    content = {
        "begin": min(float(record.run.time[0]) for record in records),
        "end": max(float(record.run.time[-1]) for record in records),
        "hull": {"length": hull.length, "beam": hull.beam},
        "panels": [_panel(payload, overlay, alone) for overlay in overlaid],
        "tracks": [_track(payload, track, alone) for track in tracks(records)],
        "plans": [_plan(payload, plan) for plan in plans(records)],
        "fences": [[[corner.real, corner.imag] for corner in ring] for ring in fences(records)],
        "stops": [_stop(payload, each) for each in stops(records)],
        "marks": _marks(records),
    }
    return content, payload.text()


def _panel(payload: Payload, overlay: Overlay, alone: bool) -> dict[str, Any]:
    """A panel as chart.js expects it, every line with its label and colour."""
    panel = overlay.panel
    lines = [
        {**payload.line(owned.line), "label": owned.label, "colour": line_colour(owned.run, owned.line.role, alone)}
        for owned in overlay.lines
    ]
    return {
        "title": panel.title,
        "unit": panel.unit,
        "limits": [limit._asdict() for limit in panel.limits],
        "step": panel.step,
        "help": panel.help,
        "lines": lines,
    }


def _track(payload: Payload, track: Track, alone: bool) -> dict[str, Any]:
    """A ship or a reference as map.js expects it."""
    colour = line_colour(track.run, DESIRED if track.role == REFERENCE else MAIN, alone)
    return {
        **payload.poses(track.time, track.poses),
        "role": track.role,
        "run": track.run,
        "label": track.label,
        "colour": colour,
    }


def _plan(payload: Payload, plan: Plan) -> dict[str, Any]:
    """Planned legs as the map draws them."""
    outlines = [payload.points(points) for points in plan.outlines]
    return {"outlines": outlines, "waypoints": [[point.real, point.imag] for point in plan.waypoints]}


def _stop(payload: Payload, found: Stops) -> dict[str, Any]:
    """A stopping set over time as the map draws it."""
    arrays = {"time": payload.add(found.time, "f8"), "reach": payload.add(found.reach), "radius": payload.add(found.radius)}
    return {"run": found.run, **arrays}


def _legs(records: Sequence[Record]) -> list[dict[str, Any]]:
    """The errors of each leg of each run that has planned legs, to a micrometre."""
    tables = []
    for record in records:
        rows = [
            (str(leg), *(quantity(round(value, 6), "m") for value in values), quantity(round(missed, 3), "%"))
            for leg, *values, missed in leg_rows(record)
        ]
        if rows:
            tables.append({"name": record.name, "rows": rows})
    return tables


def _groups(overlaid: Sequence[Overlay]) -> list[dict[str, Any]]:
    groups: dict[str, list[dict[str, Any]]] = {}
    for i, overlay in enumerate(overlaid):
        panel = overlay.panel
        shown = {"index": i, "title": panel.title, "unit": panel.unit, "help": panel.help}
        groups.setdefault(panel.group, []).append(shown)
    return [{"name": name, "panels": panels} for name, panels in groups.items()]


def _marks(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Events of all runs in the order of their times, each with its run's index and colour and the text that labels it."""
    found = []
    for run, record in enumerate(records):
        alone = len(records) == 1
        colour = "--ink-soft" if alone else run_colour(run)
        for mark in record.marks:
            what = f"{mark.kind}: {mark.text}" if mark.text else mark.kind
            label = what if alone else f"{record.name}, {what}"
            found.append({"t": mark.time, "kind": mark.kind, "text": mark.text, "label": label, "run": run, "colour": colour})
    return sorted(found, key=lambda mark: mark["t"])


def _verdicts(records: Sequence[Record]) -> list[dict[str, str]]:
    """The verdicts of the runs that have one, with the runs' names and colours."""
    return [
        {"name": record.name, "text": record.verdict, "colour": run_colour(run)}
        for run, record in enumerate(records)
        if record.verdict
    ]


def _subtitle(records: Sequence[Record]) -> str:
    """Durations, laws and ships of the runs."""
    durations = dict.fromkeys(quantity(record.duration, "s") for record in records)
    parts = [" and ".join(durations)]
    laws = dict.fromkeys(record.scenario.controller.law for record in records if record.scenario)
    if laws:
        parts.append("control law " + ", ".join(laws))
    parts += dict.fromkeys(described(record.scenario.vessel_sim.vessel) for record in records if record.scenario)
    if len(records) > 1:
        parts.insert(0, f"{len(records)} runs")
    return " · ".join(parts)


def _resolution(panels: Sequence[dict[str, Any]], records: Sequence[Record]) -> str:
    """A sentence on the resolution of the diagrams."""
    size = max((line["bucket"] for panel in panels for line in panel["lines"]), default=1)
    if size == 1:
        return "The diagrams contain every sample."
    period = float(np.median(np.diff(records[0].run.time[:1000])))
    return (
        f"The diagrams contain the minimum and the maximum of every {size} samples ({size * period:.3g} s),"
        " so no peak is lost; the bag contains all samples."
    )
