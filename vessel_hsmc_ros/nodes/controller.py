"""The controller node: runs a control law at a fixed rate on ROS time, and commands what its supervision allows."""

from collections import Counter
from typing import Any

from rclpy.duration import Duration
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.control.laws.hierarchical_parameters import sway_warning
from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.control.safety.supervision import NO_WRENCH
from vessel_hsmc_ros.core.exceptions import RefusalError
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ACKNOWLEDGE_LIMITS, LAST_COMMANDS, WARN, DiagnosticTask
from vessel_hsmc_ros.nodes.controller_inputs import ControllerInputs, listen_to_state, read_reference
from vessel_hsmc_ros.nodes.controller_output import CommandingNode, ControlDiagnostics, guard_task, operation_status
from vessel_hsmc_ros.nodes.controller_timing import Lockstep, RealTime, RideThrough, Timing
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.law_file import load_named_files
from vessel_hsmc_ros.scenario.parameters import NODES, ControllerParameters

NOT_FOR_REAL_TIME = "law hierarchical_printed tolerates no late control steps: in real time use hierarchical or guided"

CHECK_PERIODS = {"lockstep": 0.4, "real time": 1.5}
"""Time between two checks of the inputs, s: in lockstep two of them take less than the plant's command_timeout."""


class ControllerNode(CommandingNode):
    """Computes the wrench command from odometry and reference.

    Lockstep: every odometry message is answered by a command with the stamp of its step; that of late odometry is older.

    Real time: a timer on the node's clock runs the law on the latest odometry. While an input is missing, or the law must not
    command for another reason, the safe action is commanded; in standby nothing is.
    """

    NAME = "controller"
    INTERFACE = """
        subscribes to  odom, reference
        publishes      cmd_wrench, ~/state; ~/estimate with an observer; events
        services       ~/enable, ~/reset, ~/stop, ~/rearm; of its lifecycle ~/change_state, ~/get_state, ~/get_available_states,
                       ~/get_available_transitions, ~/get_transition_graph
    """
    OPTIONS = " [--law-file FILE]..."
    take_options = staticmethod(load_named_files)

    def __init__(self, **options: Any) -> None:
        self.PARAMETERS = NODES[self.NAME]  # not of the class: files may add laws after its definition
        super().__init__(**options)
        p = self.parameters
        self._steps: Timing = (RideThrough if p.ride_through else Lockstep)(self) if p.lockstep else RealTime(self)
        self._outdated = False
        newest = qos.newest(p.lockstep)
        self._state_input = listen_to_state(self, lambda measured: self._steps.take_odometry(measured), newest)
        self.listen(ReferenceState, "reference", lambda message: self._steps.take_reference(read_reference(message)), newest)
        self.reporter.offer("reset", self._reset)
        self.manage(p.autostart or p.lockstep)
        if p.lockstep:
            self.activate_quietly()
        else:
            self.loop.supervision.standby()
        self.create_timer(CHECK_PERIODS["lockstep" if p.lockstep else "real time"], self._check_inputs, clock=self.wall)

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
        p, stopped = self.parameters, self.loop.supervision.operation is Operation.STOPPED
        self.loop = make_control_loop(p)
        self.loop.supervision.standby()
        if stopped:
            self.loop.supervision.stop()
        self.inputs = ControllerInputs(self, self.loop)
        self.health = ControlDiagnostics(self.loop, p.lockstep)
        self._known, self._alarms, self._violations = self.loop.law.known, {}, Counter()
        self._steps.renewed()
        self._outdated, self._unfit = False, self._why_unfit()
        self.get_logger().info(f"configured: {self.describe()}")

    def begin(self) -> None:
        """Let the law command."""
        if problem := self._unfit or ("" if self.parameters.lockstep else self.inputs.distance_problem()):
            raise RefusalError(problem)
        if refused := self.loop.supervision.activate(self._steps.ready()):
            raise RefusalError(self.refusal_text(refused))
        self._begun = True

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
        unfit = (WARN, f"standby: {self._unfit}") if self._unfit else None
        return *(clock or unfit or self.inputs.monitor.status() or operation_status(supervision)), values

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """The node as a whole, its inputs, its output guard, and the health of law and timing."""
        guard, health = guard_task(self.loop.supervision), self.health.diagnostic_tasks(self.parameters.diagnostics)
        return [*super().diagnostic_tasks(), *self.inputs.diagnostic_tasks(), guard, *health]
