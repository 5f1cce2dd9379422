"""Overlays of several runs: panels with the same title are merged, each line with its label and its run."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.safety.fence_guard import Water, stop
from vessel_hsmc_ros.core.fence import fence_of
from vessel_hsmc_ros.core.kinematics import as_motion
from vessel_hsmc_ros.core.run_data import recorded
from vessel_hsmc_ros.guidance.planned_track import outline
from vessel_hsmc_ros.report.panels import DESIRED, MAIN, MEASURED, Line, Panel, panels
from vessel_hsmc_ros.report.record import Record
from vessel_hsmc_ros.scenario.control import braking_of

Array = NDArray[np.float64]

SHIP, REFERENCE = "ship", "reference"

STOPS = 1000  # times at which the stopping set of a run is drawn
OUTLINE = 2000  # number of points of a planned stretch between two stops


@dataclass(frozen=True)
class Owned:
    """A line with its label and the index of its run; None for a line that runs share."""

    line: Line
    label: str
    run: int | None


@dataclass(frozen=True)
class Overlay:
    """A panel with the lines of all runs; the panel itself is that of the first run that has it, with the limits of all."""

    panel: Panel
    lines: tuple[Owned, ...]


@dataclass(frozen=True)
class Track:
    """Poses of a ship or its reference: x, y, psi and more, (n, 3) or wider, over time (n,)."""

    time: Array
    poses: Array
    role: str
    label: str
    run: int | None


def overlays(records: Sequence[Record]) -> list[Overlay]:
    """Merge the panels of all runs.

    Returns the panels, group by group; groups in the order in which they first occur.
    """
    merged: dict[tuple[str, str], Overlay] = {}
    for run, record in enumerate(records):
        for panel in panels(record):
            overlay = merged.get((panel.group, panel.title), Overlay(panel, ()))
            merged[panel.group, panel.title] = _with(overlay, panel, record.name, run)
    order = list(dict.fromkeys(overlay.panel.group for overlay in merged.values()))
    found = sorted(merged.values(), key=lambda overlay: order.index(overlay.panel.group))
    return found if len(records) > 1 else [_alone(overlay) for overlay in found]


def tracks(records: Sequence[Record]) -> list[Track]:
    """The ships of all runs, then their references; runs with the same reference share one track."""
    alone = len(records) == 1
    ships = [Track(r.run.time, r.run.state, SHIP, SHIP if alone else r.name, run) for run, r in enumerate(records)]
    desired: list[Track] = []
    for run, record in enumerate(records):
        if not recorded(record.run.reference):
            continue
        poses = record.run.reference
        # Compared by value: runs of one scenario follow the same reference, which is drawn once.
        same = next((i for i, track in enumerate(desired) if np.array_equal(track.poses, poses)), None)
        if same is None:
            label = REFERENCE if alone else f"{record.name}: {REFERENCE}"
            desired.append(Track(record.run.time, poses, REFERENCE, label, run))
        else:
            desired[same] = replace(desired[same], label=REFERENCE, run=None)
    return ships + desired


@dataclass(frozen=True)
class Plan:
    """The planned legs of a run or of several: their outlines and their waypoints, m."""

    outlines: tuple[NDArray[np.complex128], ...]
    waypoints: tuple[complex, ...]


def plans(records: Sequence[Record]) -> list[Plan]:
    """The planned legs of all runs; runs with the same plan share one."""
    found: dict[tuple[complex, ...], Plan] = {}
    for record in records:
        if record.track is not None:
            found.setdefault(record.track.waypoints, Plan(tuple(outline(record.track, OUTLINE)), record.track.waypoints))
    return list(found.values())


def fences(records: Sequence[Record]) -> list[tuple[complex, ...]]:
    """The corners of the fences of all runs, polygon by polygon, each once, m."""
    found: dict[tuple[complex, ...], None] = {}
    for record in records:
        fence = fence_of(record.scenario.controller.safety.fence, "fence") if record.scenario else None
        found |= dict.fromkeys(tuple(map(complex, ring)) for ring in (fence.rings() if fence else ()))
    return list(found)


@dataclass(frozen=True)
class Stops:
    """Where the vessel of a run with a fence would come to rest in still water: how far ahead of it, and how far about that way.

    `time`: (n,) s. `reach`: negative for astern, (n,) m. `radius`: (n,) m.
    """

    run: int
    time: Array
    reach: Array
    radius: Array


def stops(records: Sequence[Record]) -> list[Stops]:
    """The stopping sets of all runs with a fence, as far as speed and force were recorded."""
    return [_stops(k, record) for k, record in enumerate(records) if fences([record]) and recorded(record.run.wrench)]


def _stops(number: int, record: Record) -> Stops:
    run, p = record.run, record.scenario.controller  # type: ignore[union-attr] # a run with a fence has a scenario
    picks = np.unique(np.linspace(0, len(run.time) - 1, min(len(run.time), STOPS)).astype(int))
    braking, force = braking_of(p), run.wrench[picks, 0] / p.vessel.surge_inertia
    found = [stop(as_motion(state), float(f), 0.0, braking, Water()) for state, f in zip(run.state[picks], force, strict=True)]
    reach = np.array([each.distance for each in found]) * np.sign(run.state[picks, 3])
    return Stops(number, run.time[picks], reach, np.array([each.radius for each in found]))


def _with(overlay: Overlay, panel: Panel, name: str, run: int) -> Overlay:
    lines = list(overlay.lines)
    several = sum(line.role not in (DESIRED, MEASURED) for line in panel.lines) > 1
    for line in panel.lines:
        same = _index_of_equal(line, lines)
        if same is None:
            label = name if line.role == MAIN and not several else f"{name}: {line.name}"
            lines.append(Owned(line, label, run))
        else:
            lines[same] = replace(lines[same], label=line.name, run=None)
    limits = tuple(dict.fromkeys((*overlay.panel.limits, *panel.limits)))
    return Overlay(replace(overlay.panel, limits=limits), tuple(lines))


def _index_of_equal(line: Line, lines: Sequence[Owned]) -> int | None:
    """Index of the line that is the same reference or truth in another run, if any."""
    for i, owned in enumerate(lines):
        if line.role == owned.line.role == DESIRED and np.array_equal(line.values, owned.line.values, equal_nan=True):
            return i
    return None


def _alone(overlay: Overlay) -> Overlay:
    """The lines of a single run, labelled by their own names."""
    return Overlay(overlay.panel, tuple(replace(owned, label=owned.line.name) for owned in overlay.lines))
