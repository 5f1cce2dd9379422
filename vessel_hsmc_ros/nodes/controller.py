"""The controller node: runs a control law at a fixed rate on ROS time, and commands what its supervision allows."""

import time
from collections import Counter
from typing import Any

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from sensor_msgs.msg import NavSatFix
from vessel_hsmc_msgs.msg import ControlState, ReferenceState

from vessel_hsmc_ros.control.interface.actuators import described
from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.laws.hierarchical_parameters import sway_warning
from vessel_hsmc_ros.control.safety.monitors import Alarm
from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.control.safety.samples import hull_problem
from vessel_hsmc_ros.control.safety.supervision import NO_WRENCH
from vessel_hsmc_ros.core.exceptions import RefusalError
from vessel_hsmc_ros.core.kinematics import same
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.conversions import Outgoing
from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ACKNOWLEDGE_LIMITS, ERROR, LAST_COMMANDS, WARN, WARNING_PERIOD, DiagnosticTask
from vessel_hsmc_ros.nodes.black_box import installed
from vessel_hsmc_ros.nodes.connections import Publishers
from vessel_hsmc_ros.nodes.controller_diagnostics import LEVELS, ControlDiagnostics, guard_task, operation_status
from vessel_hsmc_ros.nodes.controller_inputs import ControllerInputs, listen_to_state, read_reference, state_topics
from vessel_hsmc_ros.nodes.controller_timing import Lockstep, RealTime, RideThrough, Timing
from vessel_hsmc_ros.nodes.managed import ManagedNode
from vessel_hsmc_ros.nodes.reporting import RecentProblem
from vessel_hsmc_ros.nodes.vessel_sight import read_datum
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.law_file import load_named_files
from vessel_hsmc_ros.scenario.parameters import NODES, ControllerParameters

NOT_FOR_REAL_TIME = "law hierarchical_printed tolerates no late control steps: in real time use hierarchical or guided"

CHECK_PERIODS = {"lockstep": 0.4, "real time": 1.5}
"""Time between two checks of the inputs, s: in lockstep two of them take less than the plant's command_timeout."""


class ControllerNode(ManagedNode):
    """Computes the wrench command from odometry and reference.

    Lockstep: every odometry message is answered by a command with the stamp of its step; that of late odometry is older.

    Real time: a timer on the node's clock runs the law on the latest odometry. While an input is missing, or the law must not
    command for another reason, the safe action is commanded; in standby nothing is.
    """

    NAME = "controller"
    INTERFACE = """
        subscribes to  odom, reference, odom/datum (in real time), cmd_wrench (while another node publishes it),
                       /rosout (with a black box)
        publishes      cmd_wrench, controller/state, controller/estimate (with an observer), events, ~/transition_event
        services       ~/enable, ~/reset, ~/stop, ~/rearm, ~/change_state, ~/get_state, ~/get_available_states,
                       ~/get_available_transitions, ~/get_transition_graph (of its lifecycle)
    """
    OPTIONS = " [--law-file FILE]..."
    take_options = staticmethod(load_named_files)
    FIXED = frozenset(
        {"lockstep", "rate_hz", "recorded", "frame_prefix", "odometry", "observer.enabled"}
        | {"black_box", "ride_through", "autostart"}
    )

    def __init__(self, **options: Any) -> None:
        self.PARAMETERS = NODES[self.NAME]  # not of the class: files may add laws after its definition
        super().__init__(**options)
        p = self.parameters
        self._make_loop()
        self.stamp = -1  # an event before step 0 takes effect at step 0
        self.clock_problem, self._clock_step = "", RecentProblem()  # of a simulated clock, which has not begun or stands still
        self._begun, self._zeros = not (p.autostart or p.lockstep), LAST_COMMANDS
        self.datum: tuple[float, float] | None = None
        self._left = ""  # why the node went to standby by itself
        self._updates, self._compute_time, self._compute_time_max = 0, 0.0, 0.0
        self.black_box = installed(self, p.black_box, self.now)
        self._create_topics(p.lockstep)
        self._steps: Timing = (RideThrough if p.ride_through else Lockstep)(self) if p.lockstep else RealTime(self)
        newest = qos.newest(p.lockstep)
        listen_to_state(self, self._steps.take_odometry, newest)
        self.listen(ReferenceState, "reference", lambda message: self._steps.take_reference(read_reference(message)), newest)
        self.reporter.offer("reset", self._reset)
        self.manage(p.autostart or p.lockstep)
        if p.lockstep:
            self.activate_quietly()
        else:
            self.loop.supervision.standby()
            self.create_subscription(NavSatFix, DATUM, self._on_datum, qos.LATCHED)
        self.create_timer(CHECK_PERIODS["lockstep" if p.lockstep else "real time"], self._check_inputs, clock=self.wall)

    def _make_loop(self) -> None:
        """Make the control loop, and what goes with it, of the present parameters."""
        p = self.parameters
        self.loop = make_control_loop(p)
        self.inputs = ControllerInputs(self, self.loop)
        self.health = ControlDiagnostics(self.loop, p.lockstep)
        self._alarms: dict[Reason, Alarm] = {}
        self._violations: Counter[Reason] = Counter()
        self._known = self.loop.law.known
        # In lockstep the plant is simulated, where nothing breaks.
        self._unfit = "" if p.lockstep else self.missed or hull_problem(p.vessel, self.given)
        self._outdated = False

    def describe(self) -> str:
        """The law and its rate."""
        return f"law {self.parameters.law} at {self.parameters.rate_hz:g} Hz"

    def announce(self) -> None:
        """Log what the node does, and in standby how to enable it, or why it will not be."""
        super().announce()
        service = self.resolve_service_name("~/enable")
        if self._unfit:
            self.get_logger().error(f"standby, and {service} will be refused: {self._unfit}")
        elif not self.parameters.lockstep and not self.parameters.start_enabled:
            command = f"ros2 service call {service} std_srvs/srv/SetBool '{{data: true}}'"
            self.get_logger().info(f"standby: nothing is commanded; enable by {command}")

    def on_connected(self) -> None:
        """In lockstep, answer odometry received before the start; warn of a law that tolerates no delay or loses the vessel."""
        if not self.parameters.lockstep and self.parameters.law == "hierarchical_printed":
            self.get_logger().warning(NOT_FOR_REAL_TIME)
        p = self.parameters
        if p.law == "hierarchical" and (lost := sway_warning(p.hierarchical, p.vessel.as_controlled(), 1.0 / p.rate_hz)):
            self.get_logger().warning(lost)
        self._steps.start()

    def _check_inputs(self) -> None:
        if self.connected:
            self.inputs.monitor.check(self._steps.pending)

    def configure(self) -> None:
        """Make the control loop anew where parameters have been set since it was made; a stop stays latched."""
        if not self._outdated:
            return
        stopped = self.loop.supervision.operation is Operation.STOPPED
        self._make_loop()
        self.loop.supervision.standby()
        if stopped:
            self.loop.supervision.stop()
        self._steps.renewed()
        self.get_logger().info(f"configured: {self.describe()}")

    def begin(self) -> None:
        """Let the law command."""
        if problem := self._unfit or ("" if self.parameters.lockstep else self.inputs.distance_problem()):
            raise RefusalError(problem)
        if refused := self.loop.supervision.activate(self._steps.ready()):
            raise RefusalError(self.refusal_text(refused))
        self._begun, self._left = True, ""

    def refusal_text(self, reason: Reason) -> str:
        """The text of a reason, with the topic that it is about."""
        if reason is Reason.SECOND_PUBLISHER:
            return self.second_command
        if reason is Reason.NO_CONSUMER:
            return f"{reason.text}, on {self.resolve_topic_name('cmd_wrench')}"
        overdue = self._steps.overdue()
        text = self.inputs.monitor.named(overdue[0], reason) if overdue and overdue[1] is reason else reason.text
        unconnected = self.compatibility.problem() if reason is Reason.NOT_RECEIVED else ""
        return "; ".join(filter(None, (text, unconnected)))

    def pause(self) -> None:
        """Go to standby; a stop stays latched."""
        self._begun = True
        self.loop.supervision.standby()

    def stand_by(self, why: str) -> None:
        """In real time, leave it to a person to enable a controller again whose reference is not what it was."""
        if self.lifecycle == "active" and not self.parameters.lockstep:
            self._left = why
            self.get_logger().error(f"{why}: standby until ~/enable")
            self.trigger_deactivate()

    def _on_datum(self, message: NavSatFix) -> None:
        if (stated := read_datum(message)) is None:
            topic = self.resolve_topic_name(DATUM)
            self.refuse(f"{topic} must state a place in degrees (got {message.latitude}, {message.longitude}); ignored")
            return
        before, self.datum = self.datum, stated
        if before and not same(before, stated):
            self.stand_by(f"the odometry has the datum {self.datum}, before {before}: the reference is of another place")

    def halt(self) -> None:
        """Command zero from now on, and until `rearm`."""
        self._begun = True
        self.loop.supervision.stop()
        self.loop.wrench = NO_WRENCH
        self._steps.stopped()

    def rearm(self) -> None:
        """Go from the stop to standby. Raises RefusalError if the controller is not stopped."""
        if self.loop.supervision.operation is not Operation.STOPPED:
            raise RefusalError("the controller is not stopped")
        self.loop.supervision.rearm()

    def close(self) -> None:
        """In real time, leave the ship without a command: zero, acknowledged or several times."""
        # Put into standby, it may not have commanded zero yet.
        commands = self.loop.supervision.operation is not Operation.STANDBY or self._zeros < LAST_COMMANDS
        if not self.parameters.lockstep and self.connected and commands:
            self.loop.supervision.stop(Reason.SHUTTING_DOWN)
            now = self.now()
            for number in range(LAST_COMMANDS):  # a second command of one stamp would be refused with an error
                self.send(self._command_out, self._command(now + number, NO_WRENCH))
            self._command_out.wait_for_all_acked(Duration(seconds=ACKNOWLEDGE_LIMITS["real time"]))
        super().close()

    def retune(self, parameters: ControllerParameters) -> None:
        """Apply changed gains of the law; the network weights are kept. An unconfigured node takes all when it is configured."""
        if self.lifecycle == "unconfigured" and not parameters.lockstep:
            make_control_loop(parameters)
            self._outdated = True
            return
        gains = getattr(parameters, parameters.law)
        if gains != getattr(self.parameters, parameters.law):
            self.loop.retune(gains)

    def _reset(self) -> str:
        self.loop.forget()
        return "weights and estimate are reset; time goes on"

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Updates, missed periods and computation time of the law; a warning or an error while the law does not command."""
        supervision = self.loop.supervision
        values = {
            "law": self.parameters.law,
            "operation": supervision.operation.name.lower(),
            "reason": supervision.reason.name.lower(),
            "updates": self._updates,
            "missed_periods": self.loop.missed_periods,
            "references_waiting": self._steps.waiting,
            "compute_time": self._compute_time,
            "compute_time_max": self._compute_time_max,
        }
        clock = (WARN, self.clock_problem) if self.clock_problem else self._clock_step.current
        standby = self._unfit or self._left
        unfit = (WARN, f"standby: {standby}") if standby else None
        guides = "" if self.parameters.lockstep else self._guiding.conflict()
        unfit = unfit or ((ERROR, guides) if guides else None)
        return *(clock or unfit or self.inputs.monitor.status() or operation_status(supervision)), values

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """The node as a whole, its inputs, its output guard, and the health of law and timing."""
        guard, health = guard_task(self.loop.supervision), self.health.diagnostic_tasks(self.parameters.diagnostics)
        return [*super().diagnostic_tasks(), *self.inputs.diagnostic_tasks(), guard, *health]

    # -- what is published -----------------------------------------------------------------------------------------

    def _create_topics(self, lockstep: bool) -> None:
        profile, offered = qos.data(lockstep), qos.offered(lockstep, self.parameters.rate_hz)
        self._commanding = Publishers(self, WrenchStamped, "cmd_wrench")
        self._guiding = self.sources(ReferenceState, "reference")
        self._measuring = [self.sources(kind, topic) for topic, kind in state_topics(self.parameters.odometry.form).items()]
        self._command_out = self.advertise(WrenchStamped, "cmd_wrench", offered, partner=("odom", "allocated_wrench"))
        if lockstep:
            self.connections.allow_one_publisher("cmd_wrench")
        self._state_out = self.advertise(ControlState, "~/state", profile)
        if self.loop.observer:
            self._estimate_out = self.advertise(Odometry, "~/estimate", profile)
            self._estimate = Outgoing(self.framed(conversions.new_odometry()), conversions.ODOMETRY)
        self._command = Outgoing(self.framed(conversions.new_wrench()), conversions.WRENCH)
        self._state = Outgoing(self.framed(conversions.new_control_state()), conversions.CONTROL_STATE)

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
        """Whether another node commands as well, or two give references, between which the law would jump."""
        return self._commanding.count() > 1 or self._guiding.count() > 1

    def second_source(self) -> str:
        """That two nodes measure, which ends no run: a driver that was started again may still show its old publisher."""
        return next(filter(None, (source.conflict() for source in self._measuring)), "")

    @property
    def second_command(self) -> str:
        """That another node commands as well, or two give references or odometry, and which."""
        if guides := self._guiding.conflict():
            return guides
        if (source := self.second_source()) and self._commanding.count() <= 1:
            return source
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
