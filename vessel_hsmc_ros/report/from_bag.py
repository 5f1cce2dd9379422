"""What a report shows of a recorded run, from its bag: everything where it is one of ours, else what there is."""

from collections.abc import Mapping
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.bags import run_from_bag
from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.bags.topic_columns import Series
from vessel_hsmc_ros.core.exceptions import BagError, ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Metrics, evaluate
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.report.signals import Signal, Signals, of_run
from vessel_hsmc_ros.report.tables import Record
from vessel_hsmc_ros.scenario.scenario import Scenario

Array = NDArray[np.float64]

FORCES = [0, 2]
"""Of surge force, sway force and yaw moment: what the ship's actuators can give."""

NUMBERS: dict[str, tuple[tuple[str, str, Any], ...]] = {
    "vessel_sim": (
        ("steps", "steps", int),
        ("wall_time", "loop_time", float),
        ("real_time_factor", "real_time_factor", float),
        ("first_command_at", "first_command_at", float),
    ),
    "controller": (("missed_periods", "missed_periods", int), ("compute_time_max", "compute_time_max", float)),
    "recorder": (("dropped", "messages_dropped", int),),
}
"""What the nodes' diagnostics have to tell: names there and in run.json."""


class Vessel(NamedTuple):
    """One vessel's topics in a bag, those that have messages, by their names without its namespace."""

    bag: Bag
    prefix: str
    topics: dict[str, Series]


def of_bag(path: Path, namespace: str | None = None, origin: Mapping[str, Any] | None = None) -> Record:
    """The record of one vessel's run.

    Args:
        path: The bag's folder or file.
        namespace: The vessel's, where the bag has several.
        origin: What is known besides of where it comes from, by the names in run.json.

    Raises:
        BagError: the bag cannot be read or has no odometry.
    """
    bag = open_bag(path)
    prefix = bag.namespace(namespace)
    names = [name for name in (*run_from_bag.TOPICS, "cmd_wrench") if bag.topics.get(prefix + name)]
    if "odom" not in names:
        raise BagError(f"bag {path} has no message on {prefix}odom")
    vessel = Vessel(bag, prefix, {name: bag.topics[prefix + name] for name in names})
    bag.load(*(prefix + name for name in names))
    scenario = _scenario(bag)
    if scenario and all(name in names for name in run_from_bag.NEEDED):
        run = bag.run(scenario.vessel_sim.vessel.coefficients(), prefix, weights=False)
        signals = replace(of_run(run), commanded=_wrench(vessel, "cmd_wrench", _first_row(vessel)))
    else:
        signals = _signals(vessel)
    name = scenario.name if scenario else path.absolute().name
    return Record(name, signals, measured(signals), _facts(vessel, signals, scenario), scenario, _origin(bag, origin or {}))


def measured(signals: Signals) -> Metrics | None:
    """The key figures of a run; None without a reference or any wrench."""
    wrench = signals.wrench or signals.commanded
    if signals.reference is None or wrench is None:
        return None
    time, state = signals.state
    return evaluate(time, state, signals.reference.at(time), wrench.at(time))


def _scenario(bag: Bag) -> Scenario | None:
    """What the bag was recorded with; None for a bag that does not know, or is of another version."""
    try:
        return bag.scenario()
    except (ScenarioError, ParameterError):
        return None


def _origin(bag: Bag, known: Mapping[str, Any]) -> dict[str, Any]:
    told = {"bag": str(bag.path), **known, **bag.recording, "messages": f"{bag.count} on {len(bag.topics)} topics"}
    return told if bag.complete else {**told, "state": "cut off, read as far as it goes"}


def _first_row(vessel: Vessel) -> int:
    """The stamp that a run's time counts from: the first of an odometry message with applied wrench and disturbance."""
    return int(reduce(np.intersect1d, (vessel.topics[n].stamp for n in ("odom", "applied_wrench", "disturbance")))[0])


def _signals(vessel: Vessel) -> Signals:
    """The signals of a bag that lacks some: each over its own time."""
    start = int(vessel.topics["odom"].stamp.min())
    odometry, truth, reference = (_motion(vessel, name, start) for name in ("odom", "odom/truth", "reference"))
    control: dict[str, Signal] = {}
    if "controller/state" in vessel.topics:
        columns = run_from_bag.control(
            vessel.topics["controller/state"], start, lists=False, estimates=vessel.topics.get("controller/estimate")
        )
        time = columns.pop("time")
        control = {name: Signal(time, values) for name, values in columns.items()}
    return Signals(
        state=cast("Signal", truth or odometry),
        measured=odometry if truth else None,
        reference=reference,
        wrench=_wrench(vessel, "applied_wrench", start),
        commanded=_wrench(vessel, "cmd_wrench", start),
        control=control,
    )


def _motion(vessel: Vessel, name: str, start: int) -> Signal | None:
    series = vessel.topics.get(name)
    return None if series is None else _signal(series, start, run_from_bag.states(series))


def _wrench(vessel: Vessel, name: str, start: int) -> Signal | None:
    series = vessel.topics.get(name)
    return None if series is None else _signal(series, start, run_from_bag.wrenches(series)[:, FORCES])


def _signal(series: Series, start: int, values: Array) -> Signal:
    """A signal in the order of its stamps."""
    order = np.argsort(series.stamp, kind="stable")
    return Signal(run_from_bag.seconds_of(series.stamp[order] - start), values[order])


def _facts(vessel: Vessel, signals: Signals, scenario: Scenario | None) -> dict[str, Any]:
    """What the nodes said of themselves in the end."""
    bag, status = vessel.bag, dict[str, dict[str, str]]()
    if "/diagnostics" in bag.topics:
        for _, _, message in bag.messages("/diagnostics"):
            status.update(conversions.read_status(message, vessel.prefix[1:]))
    facts: dict[str, Any] = {"messages_recorded": bag.count}
    for node, names in NUMBERS.items():
        facts |= {ours: kind(status[node][theirs]) for theirs, ours, kind in names if theirs in status.get(node, {})}
    taken = signals.control.get("compute_time")
    if scenario and not scenario.controller.lockstep and taken and len(taken.time) > 1:
        off = np.abs(np.diff(taken.time) - 1.0 / scenario.controller.rate_hz)
        facts["control_interval_deviation_max"] = float(np.max(off))
    return facts
