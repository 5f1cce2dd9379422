"""Which lines a report draws, one panel above the other; every panel that the signals suffice for."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.metrics import heading_error, position_error
from vessel_hsmc_ros.report.signals import Signal, Signals

Array = NDArray[np.float64]

MAIN, DESIRED, OTHER, THIRD, MEASURED = "main", "desired", "other", "third", "measured"
"""Roles of a line: what the ship does, what it is held against, further quantities of its own, what noisy sensors said."""

AXES = ("surge", "sway", "yaw")
VELOCITIES = ("surge velocity", "sway velocity", "yaw rate")
ACCELERATION_UNITS = ("m/s²", "m/s²", "rad/s²")


@dataclass(frozen=True)
class Line:
    """One line of a panel: values (n,) over s (n,)."""

    name: str
    time: Array
    values: Array
    role: str = MAIN


@dataclass(frozen=True)
class Panel:
    """One diagram over time.

    Attributes:
        limits: Values that the lines may not pass, either way.
        step: Whether a value holds until the next.
    """

    group: str
    title: str
    unit: str
    lines: tuple[Line, ...]
    limits: tuple[float, ...] = ()
    step: bool = False


def panels(signals: Signals, limits: tuple[float, float] = (np.inf, np.inf)) -> list[Panel]:
    """All panels of a run, group by group.

    Args:
        signals: Whatever there is.
        limits: Largest surge force [N] and yaw moment [N·m] of the actuators; infinite for none.
    """
    return [
        *_errors(signals),
        *_velocities(signals),
        *_sensors(signals),
        *_surfaces(signals),
        *_wrench(signals, limits),
        *_networks(signals),
        *_disturbance(signals),
        *_timing(signals),
    ]


def _line(name: str, signal: Signal, column: int, role: str = MAIN, scale: float = 1.0) -> Line:
    values = signal.values[:, column]
    return Line(name, signal.time, values if scale == 1.0 else scale * values, role)


def _control(signals: Signals, names: Sequence[tuple[str, str]], scale: float = 1.0) -> tuple[Line, ...]:
    """Lines of the law's own terms, three at most, of those that it has: field names with the names to show."""
    lines: list[Line] = []
    for field, shown in names:
        signal = signals.control.get(field)
        if signal is not None and signal.values.ndim == 1 and not np.isnan(signal.values).all():
            lines.append(Line(shown, signal.time, scale * signal.values, (MAIN, OTHER, THIRD)[len(lines)]))
    return tuple(lines)


def _some(*candidates: Panel) -> Iterator[Panel]:
    return (panel for panel in candidates if panel.lines)


def _errors(signals: Signals) -> Iterator[Panel]:
    group, state, reference = "Errors", signals.state, signals.reference
    if reference is not None:
        desired = reference.at(state.time)
        distance, angle = position_error(state.values, desired), np.degrees(heading_error(state.values, desired))
        yield Panel(group, "position error", "m", (Line("distance", state.time, distance),))
        yield Panel(group, "heading error", "°", (Line("heading error", state.time, angle),))
    along = _control(signals, (("surge_error", "along the hull"), ("sway_error", "across")))
    yield from _some(Panel(group, "errors in the body frame", "m", along))


def _velocities(signals: Signals) -> Iterator[Panel]:
    for i, name in enumerate(VELOCITIES):
        scale = 180.0 / np.pi if i == 2 else 1.0
        candidates = (
            ("measured", signals.measured, MEASURED),
            ("ship", signals.state, MAIN),
            ("reference", signals.reference, DESIRED),
            ("estimate", signals.control.get("estimate"), OTHER),
        )
        lines = tuple(
            _line(label, signal, 3 + i, role, scale)
            for label, signal, role in candidates
            if signal is not None and (role != MEASURED or signal.values[:, 3 + i].any())  # zeros: not measured
        )
        yield Panel("Velocities", name, "°/s" if i == 2 else "m/s", lines)


def _sensors(signals: Signals) -> Iterator[Panel]:
    """How far what the sensors say, and what the observer makes of it, is from the truth."""
    told = (("measured", signals.measured, MEASURED), ("estimate", signals.control.get("estimate"), MAIN))
    there = [(name, signal, role) for name, signal, role in told if signal is not None] if signals.measured else []

    def panel(title: str, unit: str, difference: Callable[[Array, Array], Array]) -> Panel:
        lines = [
            Line(name, signal.time, difference(signal.values, signals.state.at(signal.time)), role)
            for name, signal, role in there
        ]
        return Panel("Sensors", title, unit, tuple(lines))

    yield from _some(
        panel("position off by", "m", position_error),
        panel("heading off by", "°", lambda said, true: np.degrees(heading_error(said, true))),
    )


def _surfaces(signals: Signals) -> Iterator[Panel]:
    def panel(title: str, unit: str, *names: tuple[str, str]) -> Panel:
        return Panel("Surfaces", title, unit, _control(signals, names))

    yield from _some(
        panel("surge and sway surface", "m/s", ("surge_surface", "S₂ surge"), ("sway_surface", "σ₁ sway")),
        panel("yaw and heading surface", "rad/s", ("yaw_surface", "S₁ yaw"), ("heading_surface", "σ₂ heading")),
        panel("Lyapunov function", "", ("lyapunov", "V")),
        panel("Lyapunov function, change", "1/s", ("lyapunov_rate", "dV/dt")),
    )


def _wrench(signals: Signals, limits: tuple[float, float]) -> Iterator[Panel]:
    for i, (name, unit) in enumerate((("surge force", "N"), ("yaw moment", "N·m"))):
        lines = []
        if signals.wrench is not None:
            lines.append(_line("applied", signals.wrench, i))
        if signals.commanded is not None:
            lines.append(_line("commanded", signals.commanded, i, OTHER if lines else MAIN))
        bounds = (limits[i],) if np.isfinite(limits[i]) else ()
        yield from _some(Panel("Wrench", name, unit, tuple(lines), bounds, step=True))


def _networks(signals: Signals) -> Iterator[Panel]:
    group = "Networks"
    for i, axis in enumerate(AXES):
        lines = list(_control(signals, ((f"{axis}_estimate", "estimate"),)))
        if lines and signals.unforced is not None:
            lines.append(_line("truth", signals.unforced, i, DESIRED))
        symbol = f"f_{'uvr'[i]}"
        yield from _some(Panel(group, f"{axis} dynamics {symbol}", ACCELERATION_UNITS[i], tuple(lines)))
    norms = _control(signals, [(f"{axis}_weight_norm", axis) for axis in AXES])
    yield from _some(Panel(group, "norms of the weights", "", norms))


def _disturbance(signals: Signals) -> Iterator[Panel]:
    if signals.disturbance is not None:
        for i, axis in enumerate(AXES):
            line = _line("disturbance", signals.disturbance, i)
            yield Panel("Disturbance", f"{axis} disturbance", ACCELERATION_UNITS[i], (line,))


def _timing(signals: Signals) -> Iterator[Panel]:
    taken = _control(signals, (("compute_time", "law"),), 1e3)
    yield from _some(Panel("Timing", "time the law took", "ms", taken))
    if taken and len(taken[0].time) > 1:
        intervals = 1e3 * np.diff(taken[0].time)
        if np.ptp(intervals) > 1e-3:
            yield Panel("Timing", "time between control steps", "ms", (Line("interval", taken[0].time[1:], intervals),))
