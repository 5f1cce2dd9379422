"""What the controller publishes: its command, the state of each control period, and its diagnostic tasks of law and timing."""

import math
import time
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.control.interface.actuators import described
from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop
from vessel_hsmc_ros.control.safety.monitors import NAMED_BIAS, Alarm, Bias
from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.control.safety.samples import hull_problem
from vessel_hsmc_ros.control.safety.supervision import Supervision
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.conversions import Outgoing
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS, WARNING_PERIOD
from vessel_hsmc_ros.nodes.black_box import installed
from vessel_hsmc_ros.nodes.connections import Publishers
from vessel_hsmc_ros.nodes.controller_inputs import ControllerInputs
from vessel_hsmc_ros.nodes.managed import ManagedNode
from vessel_hsmc_ros.nodes.reporting import (
    ERROR,
    MINUTE,
    OK,
    WARN,
    DiagnosticTask,
    Recent,
    RecentProblem,
    bounded,
    counted,
    saturation,
)
from vessel_hsmc_ros.scenario.control import make_control_loop
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


class CommandingNode(ManagedNode):
    """A node with a control loop and its inputs, and what it publishes of them; when the law runs is that of its subclass.

    `clock_problem`: what is wrong with a simulated clock; empty if nothing is.
    """

    FIXED = frozenset(
        (
            "lockstep",
            "rate_hz",
            "recorded",
            "frame_prefix",
            "odometry",
            "observer.enabled",
            "black_box",
            "ride_through",
            "autostart",
        )
    )

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self.loop = make_control_loop(p)
        self.inputs = ControllerInputs(self, self.loop)
        self.health = ControlDiagnostics(self.loop, p.lockstep)
        self.stamp = -1  # an event before step 0 takes effect at step 0
        self.clock_problem, self._clock_step = "", RecentProblem()
        self._begun, self._zeros = not (p.autostart or p.lockstep), LAST_COMMANDS
        self._alarms: dict[Reason, Alarm] = {}
        self._violations: Counter[Reason] = Counter()
        self._known = self.loop.law.known
        self._updates, self._compute_time, self._compute_time_max = 0, 0.0, 0.0
        self._unfit = self._why_unfit()
        self.black_box = installed(self, p.black_box, self.now)
        self._create_topics(p.lockstep)

    def _create_topics(self, lockstep: bool) -> None:
        profile, offered = qos.data(lockstep), qos.offered(lockstep, self.parameters.rate_hz)
        self._commanding = Publishers(self, WrenchStamped, "cmd_wrench")
        self._command_out = self.advertise(WrenchStamped, "cmd_wrench", offered, partner=("odom", "allocated_wrench"))
        if lockstep:
            self.connections.allow_one_publisher("cmd_wrench")
        self._state_out = self.advertise(ControlState, "~/state", profile)
        if self.loop.observer:
            self._estimate_out = self.advertise(Odometry, "~/estimate", profile)
            self._estimate = Outgoing(self.framed(conversions.new_odometry()), conversions.ODOMETRY)
        self._command = Outgoing(self.framed(conversions.new_wrench()), conversions.WRENCH)
        self._state = Outgoing(self.framed(conversions.new_control_state()), conversions.CONTROL_STATE)

    def _why_unfit(self) -> str:
        """Why no command is to be sent with these parameters; a plant in lockstep is simulated, where nothing breaks."""
        return "" if self.parameters.lockstep else self.missed or hull_problem(self.parameters.vessel, self.given)

    @property
    def computes(self) -> bool:
        """Whether the law is stepped, for its command or its terms."""
        return self.lifecycle in ("active", "inactive")

    @property
    def starts(self) -> bool:
        """Whether the law is still to begin by itself, in real time."""
        p = self.parameters
        return bool(p.start_enabled and not (self._begun or p.lockstep or self._unfit))

    def has_consumer(self) -> bool:
        """Whether a node takes the command."""
        return bool(self._command_out.get_subscription_count() > self._commanding.watching)

    def second_publisher(self) -> bool:
        """Whether another node commands as well."""
        return self._commanding.count() > 1

    @property
    def second_command(self) -> str:
        """That another node commands as well, and which."""
        topic = self.resolve_topic_name("cmd_wrench")
        return f"{Reason.SECOND_PUBLISHER.text}, on {topic}: {self._commanding.others()}"

    def publish_command(self, stamp: int) -> None:
        """Publish the present command, with the time of a step, ns; in real time and standby, nothing after some zeros."""
        self.stamp = stamp
        operation = self.loop.supervision.operation
        if operation is Operation.STANDBY and not self.parameters.lockstep:
            if self._zeros >= LAST_COMMANDS:
                return
            self._zeros += 1
        else:
            self._zeros = 0
        self.send(self._command_out, self._command(stamp, self.loop.wrench))

    def publish_period(self, stamp: int, terms: Terms | None, began: int) -> None:
        """Publish the command first, because the plant waits for it; then the state of the control period.

        `began`: when the computation of the law began, by the steady clock, ns; also on simulated time.
        """
        taken = self._compute_time = seconds(time.monotonic_ns() - began)
        self._compute_time_max = max(self._compute_time_max, taken)
        self.publish_command(stamp)
        if terms is not None:
            self._updates += 1
            self.health.stepped(terms)
            self._report_alarms()
            self._report_actuators()
        loop = self.loop
        state = terms or Terms(), int(loop.supervision.operation), int(loop.supervision.reason), taken, loop.missed_periods
        self.send(self._state_out, self._state(stamp, *state))
        if terms is not None and self.loop.estimate is not None:
            self.send(self._estimate_out, self._estimate(stamp, self.loop.estimate))

    def _report_alarms(self) -> None:
        """Log each monitor that begins to warn or to demand the safe action, and what it or the output guard has found."""
        for monitor in self.loop.watch.monitors if self.loop.watch else ():
            if monitor.alarm > self._alarms.get(monitor.reason, Alarm.OK):
                text = ": ".join(filter(None, (monitor.reason.text, monitor.detail)))
                if monitor.alarm is Alarm.SAFE:
                    self.get_logger().error(f"{text}; {self.loop.supervision.consequence}")
                    if monitor.reason is Reason.FENCE and self.loop.enabled:
                        self.reporter.event("fence", monitor.detail)
                else:  # rclpy gives each line of code one severity
                    self.get_logger().warning(text)
            self._alarms[monitor.reason] = monitor.alarm
        if (violations := self.loop.supervision.violations) and violations != self._violations:
            for reason in violations - self._violations:
                self.get_logger().error(f"{reason.text}: the safe action is commanded", throttle_duration_sec=WARNING_PERIOD)
            self._violations = violations.copy()

    def _report_actuators(self) -> None:
        """Log the actuators that the law takes the ship to have, where it has found other ones than the declared."""
        if (known := self.loop.law.known) is not self._known:
            self._known = known
            if known is not self.loop.law.vessel:
                self.get_logger().info(f"identified actuators of the yaw moment: {described(known)}; gains adapted")

    def report_clock(self, reason: Reason, problem: str) -> None:
        """Report a step of the clock."""
        self._clock_step.report(LEVELS[reason.level], problem)
        self.get_logger().warning(problem)
