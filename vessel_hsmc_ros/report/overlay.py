"""Several runs in one picture: panels of one title put together, each line with its label and whose it is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vessel_hsmc_ros.report.panels import DESIRED, MAIN, Line, Panel, panels
from vessel_hsmc_ros.report.signals import Signal
from vessel_hsmc_ros.report.tables import Record

SHIP, REFERENCE = "ship", "reference"


@dataclass(frozen=True)
class Owned:
    """A line with its label, and the number of its run; None for what all runs share."""

    line: Line
    label: str
    run: int | None


@dataclass(frozen=True)
class Overlay:
    """A panel with the lines of all runs; the panel's own lines are those of the first run that has it."""

    panel: Panel
    lines: tuple[Owned, ...]


@dataclass(frozen=True)
class Track:
    """Poses over time, (n, 6) or (n, 3), of a ship or its reference."""

    poses: Signal
    role: str
    label: str
    run: int | None


def overlays(records: Sequence[Record]) -> list[Overlay]:
    """The panels of all runs, group by group as the first run has them."""
    merged: dict[tuple[str, str], Overlay] = {}
    for run, record in enumerate(records):
        for panel in panels(record.signals, record.limits):
            overlay = merged.get((panel.group, panel.title), Overlay(panel, ()))
            merged[panel.group, panel.title] = _with(overlay, panel, record.name, run)
    order = list(dict.fromkeys(overlay.panel.group for overlay in merged.values()))
    found = sorted(merged.values(), key=lambda overlay: order.index(overlay.panel.group))
    return found if len(records) > 1 else [_alone(overlay) for overlay in found]


def tracks(records: Sequence[Record]) -> list[Track]:
    """The ships of all runs, then their references; one reference where all have the same."""
    alone = len(records) == 1
    ships = [Track(r.signals.state, SHIP, SHIP if alone else r.name, run) for run, r in enumerate(records)]
    desired: list[Track] = []
    for run, record in enumerate(records):
        reference = record.signals.reference
        if reference is None:
            continue
        same = next((i for i, track in enumerate(desired) if np.array_equal(track.poses.values, reference.values)), None)
        if same is None:
            desired.append(Track(reference, REFERENCE, REFERENCE if alone else f"{record.name}: reference", run))
        else:
            desired[same] = replace(desired[same], label=REFERENCE, run=None)
    return ships + desired


def _with(overlay: Overlay, panel: Panel, name: str, run: int) -> Overlay:
    lines = list(overlay.lines)
    for line in panel.lines:
        same = _index_of_equal(line, lines)
        if same is None:
            label = name if line.role == MAIN else f"{name}: {line.name}"
            lines.append(Owned(line, label, run))
        else:
            lines[same] = replace(lines[same], label=line.name, run=None)
    return Overlay(overlay.panel, tuple(lines))


def _index_of_equal(line: Line, lines: Sequence[Owned]) -> int | None:
    """Which of the lines is the same reference or truth as another run's, if any."""
    for i, owned in enumerate(lines):
        if line.role == owned.line.role == DESIRED and np.array_equal(line.values, owned.line.values, equal_nan=True):
            return i
    return None


def _alone(overlay: Overlay) -> Overlay:
    """The lines of a single run by their own names."""
    return Overlay(overlay.panel, tuple(replace(owned, label=owned.line.name) for owned in overlay.lines))
