"""Verification of a bag: recomputes the recorded commands from the recorded inputs, and requires bit-identical values.

The inputs pass through `ControlLoop`, as in the node, with the parameters stored in the bag. What happened to the node during the
recording, such as a changed gain, takes effect at the same step.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros import report
from vessel_hsmc_ros.bags import run_from_bag
from vessel_hsmc_ros.bags.reader import Bag, Event, changed_parameters
from vessel_hsmc_ros.bags.writer import VERSIONS
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop, ages
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.timing import Instants, RateGrid, seconds
from vessel_hsmc_ros.messages.topics import RELAYED
from vessel_hsmc_ros.report.tables import metrics_table
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.law_file import is_present
from vessel_hsmc_ros.scenario.parameters import ControllerParameters
from vessel_hsmc_ros.scenario.run_folder import RunFolder, check_writable, make_run_folder
from vessel_hsmc_ros.scenario.scenario import Scenario, dump_scenario
from vessel_hsmc_ros.simulation.loop import Recorded, replay_controller
from vessel_hsmc_ros.simulation.offline import simulate

TOPICS = ("odom", "reference", "cmd_wrench")
SURGE_AND_YAW = [0, 2]

NAMES_OF_VERSIONS = {"version": "vessel_hsmc_ros", "numpy": "NumPy", "python": "Python"}
"""The software on which recorded numbers depend, by the keys of `Bag.recording`."""


@dataclass(frozen=True)
class Verification:
    """Recorded and recomputed commands."""

    time: Array  # time of every compared command since the first odometry message, (n,)
    # recorded, computed: surge force [N] and yaw moment [N·m], (n, 2)
    recorded: Array
    computed: Array
    # number of odometry messages after the last one whose command and reference are in the bag, as in a truncated bag
    beyond: int

    @property
    def largest(self) -> tuple[float, float]:
        """The largest absolute differences of surge force and yaw moment; NaN where only one of the two values is a number."""
        both_nan = np.isnan(self.recorded) & np.isnan(self.computed)
        differences = np.where(both_nan, 0.0, np.abs(self.recorded - self.computed))
        surge, yaw = (float(np.max(column, initial=0.0)) for column in differences.T)
        return surge, yaw

    @property
    def differing(self) -> NDArray[np.intp]:
        """Indices of the commands that are not bit-identical."""
        # Compared as integers: equal NaNs are identical, and 0.0 and -0.0 are not.
        identical = self.recorded.view(np.uint64) == self.computed.view(np.uint64)
        indices: NDArray[np.intp] = np.flatnonzero(~identical.all(axis=1))
        return indices


AXES = (("surge force", "N"), ("yaw moment", "N·m"))


def verdict(result: Verification) -> list[str]:
    """The lines that report a verification: number of commands, largest difference, first difference."""
    count = len(result.time)
    surge, yaw = result.largest
    lines = [f"{count} commands over {result.time[-1]:g} s: max |delta tau| = {surge:g} N, {yaw:g} N·m"]
    if not len(result.differing):
        lines.append("every command is bit-identical")
    else:
        # With repr, which shows every digit: the values may differ in the last bit only.
        first = int(result.differing[0])
        pairs = zip(AXES, result.recorded[first].tolist(), result.computed[first].tolist(), strict=True)
        values = ", ".join(f"{name} {old!r} {unit} recorded and {new!r} {unit} now" for (name, unit), old, new in pairs)
        lines.append(f"{len(result.differing)} commands differ, the first at t = {result.time[first]:g} s: {values}")
    if result.beyond:
        lines.append(f"{result.beyond} odometry messages follow the last one whose command and reference are in the bag")
    return lines


def verify(bag: Bag, scenario: Scenario, namespace: str | None = None) -> Verification:
    """Recompute every command of a recorded lockstep run."""
    if not scenario.controller.lockstep:
        raise BagError(
            f"bag {bag.path} is of a real-time run: only bags of lockstep runs can be verified,"
            " since in real time it is not recorded which odometry message a command answers"
        )
    prefix = bag.namespace(namespace)
    for name in TOPICS:
        if not bag.readable(prefix + name):
            raise BagError(f"bag {bag.path} has no message on {prefix}{name} that can be decoded")
    _require_unaltered(bag, prefix)
    bag.load(*(prefix + name for name in TOPICS))
    odometry, reference, command = (bag.topics[prefix + name] for name in TOPICS)
    order = np.argsort(odometry.stamp, kind="stable")
    measured_at, states = odometry.stamp[order], run_from_bag.measured_states(odometry, bag.twist_frame(prefix))[order]
    stamps = run_from_bag.shown_at(measured_at, command.stamp)
    answers, answered = run_from_bag.matched(stamps, command)
    if not answered.any():
        raise BagError(f"bag {bag.path} has no command that answers an odometry message")
    last = int(np.flatnonzero(answered)[-1]) + 1  # a truncated bag may end before the command
    events = [event for event in bag.events(namespace) if event.node == "controller"]
    inputs = run_from_bag.inputs_at(stamps[:last], reference)
    recorded_inputs = _recorded(scenario, stamps[:last], measured_at[:last], states[:last], inputs)
    computed = _computed(scenario, events, recorded_inputs)
    chosen = np.flatnonzero(answered[: len(computed)])
    if not len(chosen):
        raise BagError(f"bag {bag.path} has no reference for its first odometry message")
    recorded = np.ascontiguousarray(run_from_bag.wrenches(command)[answers[chosen]][:, SURGE_AND_YAW])
    time = run_from_bag.seconds_of(stamps[chosen] - stamps[0])
    return Verification(time, recorded, computed[chosen], len(stamps) - len(computed))


def _require_unaltered(bag: Bag, prefix: str) -> None:
    """Check that scripted faults left the inputs of the controller as they were, if there were any."""
    for name in ("odom", "reference"):
        relayed = f"{prefix}{RELAYED}{name}"
        if relayed not in bag.topics:
            continue
        sent, received = ([message.data for message in bag.raw_messages(topic)] for topic in (prefix + name, relayed))
        common = min(len(sent), len(received))
        if sent[:common] != received[:common]:
            raise BagError(
                f"bag {bag.path} is of a run with faults on {prefix}{name}: its commands answer {relayed}, refused and missing"
                " inputs among them, and cannot be verified"
            )


def _recorded(
    scenario: Scenario, stamps: Instants, measured_at: Instants, states: Array, inputs: tuple[NDArray[np.bool_], Array, Array]
) -> Recorded:
    """The inputs of the controller up to the first missing reference.

    The law has a state: from a missing input on, no later command can be recomputed.
    """
    known, references, accelerations = inputs
    grid = RateGrid(scenario.controller.rate_hz)
    periods = grid.indices(stamps)
    due = np.ones(len(stamps), np.bool_)
    due[1:] = np.diff(periods) != 0
    missing = np.flatnonzero(due & ~known)
    end = int(missing[0]) if len(missing) else len(stamps)
    motion, desired, acceleration = (np.ascontiguousarray(values[:end]) for values in (states, references, accelerations))
    at, then = stamps[:end].copy(), measured_at[:end].copy()
    return Recorded(at, due[:end], then, ages(at, then, grid.period)[0], motion, desired, acceleration, np.empty((end, 2)))


def _computed(scenario: Scenario, events: Sequence[Event], recorded: Recorded) -> Array:
    """The wrench for each odometry message, as the node would compute it, (n, 2)."""
    controller = scenario.controller
    loop = make_control_loop(controller)
    time, start = (recorded.stamp - recorded.stamp[:1]) * 1e-9, 0
    # An event has the stamp of the node's latest command, so it takes effect from the next odometry message on.
    for at, group in itertools.groupby(events, key=lambda event: event.time):
        stop = max(start, int(np.searchsorted(time, at, side="right")))
        replay_controller(loop, recorded, range(start, stop))
        start = stop
        if start < len(time):
            controller = _apply(loop, controller, [*group])
    replay_controller(loop, recorded, range(start, len(time)))
    return recorded.wrench


def _apply(loop: ControlLoop, controller: ControllerParameters, events: Sequence[Event]) -> ControllerParameters:
    """Apply what happened to the controller between two steps; returns its new parameters."""
    # All changes of a request together, as in the node: a limit may depend on another parameter.
    if changes := {name.partition(".")[2]: value for name, value in changed_parameters(events).items()}:
        controller = schema.changed(controller, changes, "controller")
        loop.retune(getattr(controller, controller.law))
    commands = loop.supervision
    acts = {"enable": commands.activate, "disable": commands.standby, "stop": commands.stop, "rearm": commands.rearm}
    for event in events:
        if event.kind == "reset":
            loop.forget()
        elif event.kind in acts:
            acts[event.kind]()
    return controller


def parameter_changes(bag: Bag, namespace: str | None = None) -> list[float]:
    """Log times, in s, at which parameters of the controller were changed during the recording."""
    if not bag.readable("/parameter_events"):
        return []
    name = f"{bag.namespace(namespace)}controller"
    events = bag["/parameter_events"]
    columns = zip(events.log_time.tolist(), events["node"], events["changed_parameters"], strict=True)
    return [seconds(time) for time, node, changed in columns if node == name and len(changed)]


def version_note(bag: Bag) -> str:
    """Compare the versions that a bag was recorded with to the present ones, in one line.

    Another version of NumPy or Python may round elementary functions differently, by some 1e-16 of a value, and the law's gains
    turn that into differences of the command by some 1e-10 N.
    """
    recorded = {key: bag.recording.get(key, "of unknown version") for key in VERSIONS}
    then, now = (", ".join(f"{NAMES_OF_VERSIONS[key]} {versions[key]}" for key in VERSIONS) for versions in (recorded, VERSIONS))
    law = bag.recording.get("law_source", "")
    if law and not is_present(law):
        return f"recorded with the law of {law}; its present code is another one"
    if recorded == VERSIONS:
        return f"recorded with the present versions: {now}"
    return f"recorded with {then}; recomputed with {now}: other versions may differ by rounding errors"


@dataclass(frozen=True)
class Rerun:
    """A comparison of a recorded run with its repetition."""

    folder: RunFolder  # where its page and figures are
    change: str  # the changed parameters, as text
    table: list[tuple[str, str, str, str]]  # metric, recorded value, repeated value, difference


def rerun(bag: Bag, changes: Mapping[str, object], namespace: str | None, output: Path) -> Rerun:
    """Run a bag's scenario offline with changed parameters, for as long as the recorded run lasted."""
    from vessel_hsmc_ros.report import figures  # matplotlib takes a while to load

    check_writable(output)
    # For as long as the recording: metrics of runs of different duration would not be comparable.
    scenario = _shortened(bag.scenario(dict(changes), namespace=bag.namespace(namespace)), bag, namespace)
    recorded = replace(report.of_bag(bag.path, namespace), name="recorded")
    run = simulate(scenario)
    change = ", ".join(f"{name} = {value}" for name, value in changes.items())
    repeated = report.analyse(f"with {change}", run, scenario)
    folder = make_run_folder(output, f"{scenario.name}_again")
    folder.write_parameters(dump_scenario(scenario))
    report.write(folder.report, [recorded, repeated], f"{scenario.name}, recorded and with {change}")
    figures.draw([recorded, repeated], folder.figures)
    common = [row for row in metrics_table([recorded, repeated]) if None not in row.values]
    return Rerun(folder, change, [(row.label, row.text(0), row.text(1), row.difference(1)) for row in common])


def _shortened(scenario: Scenario, bag: Bag, namespace: str | None) -> Scenario:
    """The scenario with the duration of the recording, where that ended earlier than planned."""
    stamps = bag.topics[f"{bag.namespace(namespace)}odom"].stamp
    recorded = seconds(int(stamps.max() - stamps.min())) if len(stamps) else 0.0
    planned = scenario.vessel_sim.duration
    if planned and planned <= recorded:
        return scenario
    return replace(scenario, vessel_sim=replace(scenario.vessel_sim, duration=recorded))
