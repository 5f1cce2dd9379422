"""The diagrams of a report: the panels over time and their lines, for the quantities that a run contains."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.safety.fence_guard import Water, stop
from vessel_hsmc_ros.core.fence import fence_of
from vessel_hsmc_ros.core.kinematics import as_motion
from vessel_hsmc_ros.core.metrics import Run, body_error, commanded, heading_error, held, position_error, recorded
from vessel_hsmc_ros.guidance.planned_track import outline
from vessel_hsmc_ros.report.record import Limit, Record, control_intervals, limits
from vessel_hsmc_ros.scenario.control import braking_of

Array = NDArray[np.float64]


_NETWORK = (
    "What the law's network has learnt, beside the truth: the acceleration by hydrodynamic forces and disturbance together,"
    " without the actuators. Good: the estimate follows the truth."
)
_DEVIATION = (
    "Difference between the measured or estimated value and the true one. Good: the estimate is closer than the measurement."
)
_VELOCITY = "Velocity of the ship and of its reference. Good: both are equal after the transient."
_DISTURBANCE = "Acceleration by wind, waves and periodic loads; the law does not know it."
_SURFACE = "Sliding surfaces of the law: combinations of errors and their rates. Good: they reach zero and stay there."

HELP = {
    "position error": "Distance between ship and reference. Good: it falls to a small value and stays there.",
    "position error in the body frame": (
        "Position of the ship relative to the reference, along the ship's axes: positive is ahead of the reference, or to port"
        " of it. Good: both are near zero."
    ),
    "cross-track error": (
        "Distance of the ship from the planned leg or turn, positive to port of it. Good: near zero on the legs; it does not"
        " depend on the motion of the reference."
    ),
    "along-track error": "Way by which the ship is ahead of the plan along its leg or turn. Good: near zero.",
    "heading error": (
        "Heading of the ship minus that of the reference, positive counter-clockwise. Good: near zero; a ship without a sway"
        " actuator may need a constant angle against current or wind."
    ),
    **dict.fromkeys(("surge velocity", "sway velocity", "yaw rate"), _VELOCITY),
    **dict.fromkeys(("position, deviation from the truth", "heading, deviation from the truth"), _DEVIATION),
    "z_e of (11)": (
        "Error variables of the paper: differences of positions that are each resolved in their own ship's frame. They depend on"
        " the origin of the coordinates and may be large while the ship is on its reference."
    ),
    "surge and sway surfaces": _SURFACE,
    "yaw and heading surfaces": _SURFACE,
    "Lyapunov function": "The measurable part of the Lyapunov function, (S₁² + S₂²)/2. Good: it decreases to zero.",
    "Lyapunov function, time derivative": "Rate of the Lyapunov function. Good: negative until the surfaces are reached.",
    "surge force": "Force of the propeller. Good: smooth, and within the limits, which are drawn if the values come near them.",
    "yaw moment": "Moment of the rudder. Good: smooth, and within the limits, which are drawn if the values come near them.",
    "surge dynamics f_u and disturbance": _NETWORK,
    "sway dynamics f_v and disturbance": _NETWORK,
    "yaw dynamics f_r and disturbance": _NETWORK,
    "weight norms": "Size of the weights of each network. Good: they approach constant values.",
    **dict.fromkeys(("surge disturbance", "sway disturbance", "yaw disturbance"), _DISTURBANCE),
    "computation time of the law": "Time that one update of the law took on this machine. Good: far below the control period.",
    "control interval": "Time between two updates of the law, without pauses. Good: close to the control period.",
}


MAIN, DESIRED, OTHER, THIRD, MEASURED = "main", "desired", "other", "third", "measured"
"""Roles of a line: the ship's own quantity, its desired or true value, further quantities, noisy measurements."""

AXES = ("surge", "sway", "yaw")
VELOCITIES = ("surge velocity", "sway velocity", "yaw rate")
ACCELERATION_UNITS = ("m/s²", "m/s²", "rad/s²")

JITTER = 1e-6  # control intervals whose spread is below this are constant, as in lockstep, and not drawn, s


@dataclass(frozen=True)
class Line:
    """One line of a panel: values (n,) over time (n,) s."""

    name: str
    time: Array
    values: Array
    role: str = MAIN


@dataclass(frozen=True)
class Panel:
    """One diagram over time."""

    # group, title, unit: its section, its title and the unit of its values
    group: str
    title: str
    unit: str
    lines: tuple[Line, ...]  # at least one
    limits: tuple[Limit, ...] = ()  # saturation limits, drawn at plus and minus each value
    step: bool = False  # whether a value is held until the next one
    help: str = ""  # one or two plain sentences: what it shows, what is good


def panels(record: Record) -> list[Panel]:
    """All panels of a run, group by group; quantities that were not recorded, that is, are NaN, have none."""
    run = record.run
    groups = (
        _track_errors(record),
        _errors(run),
        _velocities(run),
        _sensors(run),
        _error_variables(run),
        _surfaces(run),
        _wrench(run, limits(record.scenario)),
        _networks(run),
        _disturbance(run),
        _timing(record),
    )
    return [replace(panel, help=HELP[panel.title]) for group in groups for panel in group if panel.lines]


def _control(run: Run, names: Sequence[tuple[str, str]]) -> tuple[Line, ...]:
    """Lines of terms of the law, as far as it computes them.

    `names`: keys of `Run.control` with their labels, at most three.
    """
    lines: list[Line] = []
    for key, label in names:
        values = run.control.get(key)
        if values is not None and values.ndim == 1 and recorded(values):
            lines.append(Line(label, run.control["time"], values, (MAIN, OTHER, THIRD)[len(lines)]))
    return tuple(lines)


def _errors(run: Run) -> Iterator[Panel]:
    if not recorded(run.reference):
        return
    body, angle = body_error(run.state, run.reference), np.degrees(heading_error(run.state, run.reference))
    distance = Line("distance", run.time, position_error(run.state, run.reference))
    forward, port = Line("forward", run.time, body[:, 0]), Line("to port", run.time, body[:, 1], OTHER)
    yield Panel("Errors", "position error", "m", (distance,))
    yield Panel("Errors", "position error in the body frame", "m", (forward, port))
    yield Panel("Errors", "heading error", "°", (Line("heading error", run.time, angle),))


def _track_errors(record: Record) -> Iterator[Panel]:
    """Errors against the planned legs and turns."""
    errors = record.track_errors
    if errors is None or not recorded(errors.cross):
        return
    for name, values in (("cross-track", errors.cross), ("along-track", errors.along)):
        legs = Line("on legs", record.run.time, np.where(errors.turn, np.nan, values))
        turns = Line("in turns", record.run.time, np.where(errors.turn, values, np.nan), OTHER)
        yield Panel("Errors", f"{name} error", "m", (legs, turns))


def _error_variables(run: Run) -> Iterator[Panel]:
    # Every law may record z_e, but only one with the sway surface (12) uses it: elsewhere it would only be misread.
    if recorded(run.control.get("sway_surface")):
        lines = _control(run, (("surge_error", "z₁ₑ"), ("sway_error", "z₂ₑ")))
        yield Panel("Error variables of the paper's law", "z_e of (11)", "m", lines)


def _velocities(run: Run) -> Iterator[Panel]:
    candidates = (
        ("measured", _measurements(run), MEASURED),
        ("ship", (run.time, run.state), MAIN),
        ("reference", (run.time, run.reference), DESIRED),
        ("estimate", _estimate(run), OTHER),
    )
    for i, name in enumerate(VELOCITIES):
        scale, unit = (180.0 / np.pi, "°/s") if name == "yaw rate" else (1.0, "m/s")
        lines = []
        for label, samples, role in candidates:
            if samples is None or not recorded(samples[1]):
                continue
            time, values = samples[0], samples[1][:, 3 + i]
            if role != MEASURED or values.any():  # a sensor that does not measure a velocity reports zeros
                lines.append(Line(label, time, scale * values, role))
        yield Panel("Velocities", name, unit, tuple(lines))


def _measurements(run: Run) -> tuple[Array, Array] | None:
    """Times and values of noisy measurements; None where the sensors are perfect."""
    return None if np.array_equal(run.measured, run.state) else (run.time, run.measured)


def _estimate(run: Run) -> tuple[Array, Array] | None:
    """Times and values of the observer's estimate; None without an observer."""
    values = run.control.get("estimate")
    return None if values is None or not recorded(values) else (run.control["time"], values)


def _sensors(run: Run) -> Iterator[Panel]:
    """Deviations of measurements and estimates from the true pose."""
    measurements = _measurements(run)
    if measurements is None:
        return
    found = [("measured", measurements, MEASURED), ("estimate", _estimate(run), MAIN)]
    position, heading = [], []
    for name, samples, role in found:
        if samples is None:
            continue
        time, values = samples
        truth = held(run.time, run.state, time)
        position.append(Line(name, time, position_error(values, truth), role))
        heading.append(Line(name, time, np.degrees(heading_error(values, truth)), role))
    yield Panel("Sensors", "position, deviation from the truth", "m", tuple(position))
    yield Panel("Sensors", "heading, deviation from the truth", "°", tuple(heading))


def _surfaces(run: Run) -> Iterator[Panel]:
    def panel(title: str, unit: str, *names: tuple[str, str]) -> Panel:
        return Panel("Surfaces", title, unit, _control(run, names))

    yield panel("surge and sway surfaces", "m/s", ("surge_surface", "S₂ surge"), ("sway_surface", "σ₁ sway"))
    yield panel("yaw and heading surfaces", "rad/s", ("yaw_surface", "S₁ yaw"), ("heading_surface", "σ₂ heading"))
    yield panel("Lyapunov function", "", ("lyapunov", "V"))
    yield panel("Lyapunov function, time derivative", "1/s", ("lyapunov_rate", "dV/dt"))


def _wrench(run: Run, limits: tuple[tuple[Limit, ...], tuple[Limit, ...]]) -> Iterator[Panel]:
    # Drawn as steps: the wrench is held between two commands (zero-order hold).
    command = commanded(run)
    for i, (name, unit) in enumerate((("surge force", "N"), ("yaw moment", "N·m"))):
        lines = []
        if recorded(run.wrench):
            lines.append(Line("applied", run.time, run.wrench[:, i]))
        if command is not None:
            lines.append(Line("commanded", command[0], command[1][:, i], OTHER if lines else MAIN))
        yield Panel("Wrench", name, unit, tuple(lines), limits[i], step=True)


def _networks(run: Run) -> Iterator[Panel]:
    # Networks cannot separate what acts together: they learn f_u, f_v, f_r of (7) and the disturbance tau_uw, tau_vw, tau_rw.
    truth = run.unforced_acceleration + run.disturbance
    for i, axis in enumerate(AXES):
        lines = list(_control(run, ((f"{axis}_estimate", "estimate"),)))
        if lines and recorded(truth):
            lines.append(Line("truth", run.time, truth[:, i], DESIRED))
        yield Panel("Networks", f"{axis} dynamics f_{'uvr'[i]} and disturbance", ACCELERATION_UNITS[i], tuple(lines))
    yield Panel("Networks", "weight norms", "", _control(run, [(f"{axis}_weight_norm", axis) for axis in AXES]))


def _disturbance(run: Run) -> Iterator[Panel]:
    if recorded(run.disturbance):
        for i, axis in enumerate(AXES):
            line = Line("disturbance", run.time, run.disturbance[:, i])
            yield Panel("Disturbance", f"{axis} disturbance", ACCELERATION_UNITS[i], (line,))


def _timing(record: Record) -> Iterator[Panel]:
    yield Panel("Timing", "computation time of the law", "s", _control(record.run, (("compute_time", "law"),)))
    times, intervals = control_intervals(record.run, record.marks)
    if len(intervals) and np.ptp(intervals) > JITTER:
        yield Panel("Timing", "control interval", "s", (Line("interval", times, intervals),))


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
    if len(records) > 1:
        return found
    return [Overlay(each.panel, tuple(replace(owned, label=owned.line.name) for owned in each.lines)) for each in found]


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


class Plan(NamedTuple):
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
