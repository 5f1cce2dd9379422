"""The diagnostic tasks of the controller: law and timing, output guard, monitors, compass."""

import math
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop
from vessel_hsmc_ros.control.safety.monitors import NAMED_BIAS, Alarm, Bias
from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.control.safety.supervision import Supervision
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.nodes.reporting import (
    ERROR,
    MINUTE,
    OK,
    WARN,
    DiagnosticTask,
    Recent,
    bounded,
    counted,
    saturation,
)
from vessel_hsmc_ros.scenario.parameter_groups import DiagnosticsParameters

SPAN = 5.0  # time over which the scatter of the control period is evaluated, s
CONDITION_LIMIT = 1e12  # condition of the correlation matrix of the observer above which its numbers lose their meaning


class ControlDiagnostics:
    """Collects what the diagnostic tasks need, once a control period, and states them on request.

    `lockstep`: whether the plant sets the pace, so that there is no control period to keep.
    """

    def __init__(self, loop: ControlLoop, lockstep: bool) -> None:
        self._loop, self._lockstep = loop, lockstep
        self._intervals: deque[int] = deque(maxlen=max(2, round(SPAN / loop.grid.period)))
        self._last: int | None = None
        self._terms = Terms()
        self._updates = self._saturated = 0
        self._recent = {name: Recent() for name in ("missed", "updates", "saturated")}

    def served(self, now: int) -> None:
        """Note the time at which a control period is served, ns."""
        if self._last is not None:
            self._intervals.append(now - self._last)
        self._last = now

    def stepped(self, terms: Terms) -> None:
        """Note the terms of a control period."""
        self._terms = terms
        self._updates += 1
        self._saturated += terms.surge_saturated or terms.yaw_saturated

    def diagnostic_tasks(self, limits: DiagnosticsParameters) -> list[DiagnosticTask]:
        """All of them, with the limits above which they warn."""
        t, watch = self._terms, self._loop.watch
        alarms = {monitor.reason: monitor.alarm for monitor in watch.monitors} if watch else {}
        of = self._recent["updates"].increase(self._updates)
        share = self._recent["saturated"].increase(self._saturated) / max(of, 1)
        missed = self._loop.missed_periods
        surfaces = {"surge": t.surge_surface, "sway": t.sway_surface, "heading": t.heading_surface, "yaw": t.yaw_surface}
        norms = {"surge": t.surge_weight_norm, "sway": t.sway_weight_norm, "yaw": t.yaw_weight_norm}
        return [
            *([] if self._lockstep else [self._period()]),
            counted(
                "missed deadlines",
                missed,
                self._recent["missed"].increase(missed),
                MINUTE / self._loop.grid.period,
                "missed periods",
            ),
            saturation(share, lasting=alarms.get(Reason.SATURATED, Alarm.OK) is not Alarm.OK),
            *([monitors(alarms, [m.detail for m in watch.monitors if m.detail]), compass(watch.heading.found)] if watch else []),
            bounded("surface magnitude", surfaces, limits.surface_limit),
            bounded("weight norm", norms, limits.weight_norm_limit),
            self._numerical_health(),
        ]

    def _period(self) -> DiagnosticTask:
        """Scatter of the control period: a warning where one of twenty is off by more than half."""
        intervals = list(self._intervals)
        nominal = self._loop.grid.period
        off = sorted(abs(interval / NANOSECONDS - nominal) for interval in intervals) or [0.0]
        usual = off[int(0.95 * (len(off) - 1))]
        level = WARN if usual > 0.5 * nominal else OK
        message = f"95 % within {1e3 * usual:.2f} ms of {1e3 * nominal:g} ms"
        return DiagnosticTask("period", level, message, {"nominal": nominal, "deviation_p95": usual, "deviation_max": off[-1]})

    def _numerical_health(self) -> DiagnosticTask:
        t = self._terms
        values = {name: value for name, value in t._asdict().items() if isinstance(value, float)}
        infinite = [name for name, value in values.items() if math.isinf(value)]
        if not all(map(math.isfinite, self._loop.wrench)):
            infinite.append("wrench")
        if infinite:
            return DiagnosticTask("numerical health", ERROR, f"not finite: {', '.join(infinite)}", {})
        if not self._loop.observer:
            return DiagnosticTask("numerical health", OK, "all values are finite", {})
        condition = correlation_condition(self._loop.observer.covariance)
        if not condition < CONDITION_LIMIT:
            return DiagnosticTask("numerical health", ERROR, "the observer's covariance is singular", {"condition": condition})
        return DiagnosticTask("numerical health", OK, "all values are finite", {"condition": condition})


def monitors(alarms: Mapping[Reason, Alarm], details: Sequence[str] = ()) -> DiagnosticTask:
    """The monitors of what no single sample shows, by what each of them looks for, and what they have found."""
    raised = [*(reason.text for reason, alarm in alarms.items() if alarm is not Alarm.OK), *details]
    level = ERROR if Alarm.SAFE in alarms.values() else WARN if raised else OK
    shown = {reason.name.lower(): alarm.name.lower() for reason, alarm in alarms.items()}
    return DiagnosticTask("monitors", level, "; ".join(raised) or "nothing found", shown)


def compass(found: Bias | None) -> DiagnosticTask:
    """What the courses of the ship show of its compass: a warning where that is to be corrected."""
    if found is None:
        return DiagnosticTask("compass", OK, "not shown by the courses so far", {})
    values = {"bias": found.angle, "deviation": found.deviation}
    return DiagnosticTask("compass", WARN if found.lost or found.beyond > NAMED_BIAS else OK, found.text(), values)


def correlation_condition(covariance: NDArray[np.float64]) -> float:
    """Condition number of the correlation matrix of a covariance, (n, n); infinite where it is not positive definite.

    Unlike that of the covariance, it does not depend on the units of the states. States without variance are left out.
    """
    variance = np.diag(covariance)
    if not (np.isfinite(covariance).all() and (variance >= 0.0).all()):
        return math.inf
    kept = variance > 0.0
    scale = 1.0 / np.sqrt(variance[kept])
    values = np.linalg.eigvalsh(covariance[np.ix_(kept, kept)] * np.outer(scale, scale))
    if len(values) == 0:
        return 1.0
    return float(values[-1] / values[0]) if values[0] > 0.0 else math.inf


LEVELS = {"ok": OK, "warn": WARN, "error": ERROR}  # diagnostics levels of reasons


def operation_status(supervision: Supervision) -> tuple[bytes, str]:
    """Level and message of the present operation: OK while the law commands."""
    if supervision.operation is Operation.ACTIVE:
        return OK, "running"
    return LEVELS[supervision.reason.level], f"{supervision.operation.name.lower()}: {supervision.reason.text}"


def guard_task(supervision: Supervision) -> DiagnosticTask:
    """The output guard: an error while a violation of it is the reason of the safe action."""
    counts = {reason.name.lower(): count for reason, count in supervision.violations.items()}
    broken = supervision.reason in supervision.violations
    return DiagnosticTask("guard", ERROR if broken else OK, "violated" if broken else "no violation", counts)
