"""Reads the record of a run from a bag: of this package completely, of another recorder as far as its topics allow."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.bags import run_from_bag
from vessel_hsmc_ros.bags.reader import Bag, Event, open_bag
from vessel_hsmc_ros.core.exceptions import BagWarning, ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Run, held
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, stretches_of
from vessel_hsmc_ros.messages.conversions import path_event
from vessel_hsmc_ros.preflight.expected import faults_in
from vessel_hsmc_ros.report.record import Mark, Record, analyse, control_intervals, has_legs, planned
from vessel_hsmc_ros.scenario.scenario import Scenario

Array = NDArray[np.float64]
WITH_VALUES = ("parameter", "goal", "path", "fault")
"""Kinds of events whose text has values; that of the others repeats their kind."""

TOGETHER = 1.0  # events of one kind within this time are one call of several nodes, s
DIAGNOSTICS: dict[str, tuple[tuple[str, str, Any], ...]] = {
    "vessel_sim": (
        ("steps", "steps", int),
        ("wall_time", "loop_time", float),
        ("real_time_factor", "real_time_factor", float),
        ("first_command_at", "first_command_at", float),
    ),
    "controller": (("missed_periods", "missed_periods", int), ("compute_time_max", "compute_time_max", float)),
    "recorder": (("dropped", "messages_dropped", int),),
}
"""Values of the nodes' diagnostics: their keys there, their names in run.json, their types."""


def of_bag(path: Path, namespace: str | None = None, origin: Mapping[str, Any] | None = None) -> Record:
    """Read the record of one vessel's run.

    `origin`: further provenance of the run, by its keys in run.json. Raises BagError if the bag cannot be read or has no
    odometry.
    """
    bag = open_bag(path)
    return of_vessel(bag, bag.namespace(namespace), origin)


def of_vessel(bag: Bag, prefix: str, origin: Mapping[str, Any] | None = None) -> Record:
    """Read the record of one vessel of an opened bag. Raises BagError if the bag has no odometry of the vessel."""
    scenario = _scenario(bag, prefix)
    vessel = scenario.vessel_sim.vessel.coefficients() if scenario else None
    topics, run, start, events = bag.record(prefix, vessel)
    run = _with_commands(run, topics, start)
    # In a run folder the bag is named `bag`, and the folder bears the name of the run.
    folder = bag.path.absolute()
    name = scenario.name if scenario else (folder.parent if folder.name == "bag" else folder).name
    marks = _marks(events)
    track = _track(bag, prefix, scenario, marks, start)
    known = {**(origin or {}), **({} if scenario else _faults(bag))}  # a simulated run has none but scripted ones
    facts = _facts(bag, prefix, scenario, control_intervals(run, marks)[1])
    return analyse(name, run, scenario, marks, track=track, facts=facts, provenance=_origin(bag, known))


def of_fleet(bag: Bag, origin: Mapping[str, Any] | None = None) -> list[Record]:
    """Read the records of all vessels of a bag, named by their namespaces. Raises BagError if a vessel has no odometry."""
    prefixes = sorted(bag.namespaces, key=lambda prefix: (len(prefix), prefix))  # vessel_10 after vessel_2
    found = [bag.find(prefix, name) for prefix in prefixes for name in run_from_bag.TOPICS]
    bag.load(*(series.name for series in found if series is not None))  # in one pass over the bag
    records = []
    for prefix in prefixes:
        name = prefix.strip("/")
        records.append(replace(of_vessel(bag, prefix, {**(origin or {}), "namespace": name}), name=name or prefix))
    return records


def _scenario(bag: Bag, prefix: str) -> Scenario | None:
    """The scenario of the recording; None for bags without one, or with one of an incompatible version."""
    try:
        return bag.scenario(any_law=True, namespace=prefix)
    except (ScenarioError, ParameterError):
        return None


def _faults(bag: Bag) -> dict[str, str]:
    """What is wrong with stamps, frames and units of a recording, for the page; a BagWarning names it as well."""
    faults = faults_in(bag)
    for text in faults:
        warnings.warn(f"bag {bag.path}: {text}", BagWarning, stacklevel=2)
    return {"faults": "; ".join(faults)} if faults else {}


def _origin(bag: Bag, known: Mapping[str, Any]) -> dict[str, Any]:
    origin = {"bag": str(bag.path), **known, **bag.recording, "messages": f"{bag.count} on {len(bag.topics)} topics"}
    if bag.complete:
        return origin
    return {**origin, "state": f"without {', '.join(bag.missing)}" if bag.missing else "cut off, read as far as it is intact"}


def _with_commands(run: Run, topics: run_from_bag.Topics, start: int) -> Run:
    """Add the commanded wrench to the terms of the law, held at their times.

    `start`: stamp at which the time of the run is zero, ns.
    """
    commands = topics.get("cmd_wrench")
    if commands is None:
        return run
    if "controller/state" in topics:
        values = held(commands.stamp, run_from_bag.forces(commands), topics["controller/state"].stamp)
        return replace(run, control={**run.control, "commanded": values})
    order = np.argsort(commands.stamp, kind="stable")
    times = run_from_bag.seconds_of(commands.stamp[order] - start)
    return replace(run, control={"time": times, "commanded": run_from_bag.forces(commands)[order]})


def _marks(events: Sequence[Event]) -> tuple[Mark, ...]:
    """Events as marks: parameters, goals and paths with their values, others with their nodes; one for all nodes of a call."""
    marks: list[Mark] = []
    for time, node, kind, text in events:
        last = marks[-1] if marks else None
        if kind in WITH_VALUES:
            marks.append(Mark(time, kind, text))
        elif last is not None and last.kind == kind and time - last.time < TOGETHER:
            marks[-1] = last._replace(text=f"{last.text}, {node}")
        else:
            marks.append(Mark(time, kind, node))
    return tuple(marks)


def _track(bag: Bag, prefix: str, scenario: Scenario | None, marks: Sequence[Mark], start: int) -> PlannedTrack | None:
    """The planned legs of a run, from its scenario and from the paths that were set by messages.

    `start`: stamp at which the time of the run is zero, ns.
    """
    if not has_legs(scenario) or not bag.readable(f"{prefix}reference"):
        return None
    messages = bag.topics[f"{prefix}path"]["poses"] if bag.readable(f"{prefix}path") else ()
    sent = [[(pose.pose.position.x, pose.pose.position.y) for pose in poses] for poses in messages if poses]
    paths = []
    for mark in marks:
        # Of the messages, those that the reference has taken.
        while mark.kind == "path" and sent:
            points = sent.pop(0)
            if mark.text == path_event(points):
                paths.append((mark.time, points))
                break
    track = planned(scenario, paths)
    # In real time the reference begins a little before or after the first odometry.
    delay = 1e-9 * int(bag.topics[f"{prefix}reference"].stamp.min() - start)
    return track and track._replace(stretches=stretches_of(track.stretches, delay))


def _facts(bag: Bag, prefix: str, scenario: Scenario | None, intervals: Array) -> dict[str, Any]:
    """Values of the nodes' final diagnostics, and the largest deviation of the control interval from its nominal value."""
    status = bag.diagnostics(prefix)
    facts: dict[str, Any] = {"messages_recorded": bag.count}
    if len(bag.namespaces) > 1:  # one recorder for several vessels
        facts["messages_recorded"] = sum(series.count for name, series in bag.topics.items() if name.startswith(prefix))
        facts["messages_dropped"] = int(bag.recording.get("messages_dropped", 0))
    for node, names in DIAGNOSTICS.items():
        facts |= {ours: kind(status[node][theirs]) for theirs, ours, kind in names if theirs in status.get(node, {})}
    if scenario and not scenario.controller.lockstep and len(intervals):
        deviation = np.abs(intervals - 1.0 / scenario.controller.rate_hz)
        facts["control_interval_deviation_max"] = float(np.max(deviation))
    return facts
