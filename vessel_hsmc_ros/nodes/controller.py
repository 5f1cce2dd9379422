"""The controller node: runs a control law at a fixed rate on ROS time."""

import sys
import time
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from vessel_hsmc_msgs.msg import ControlState, ReferenceState

from vessel_hsmc_ros.core.exceptions import ControlError, LawError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.laws import Terms
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, Concern, VesselNode
from vessel_hsmc_ros.nodes.black_box import installed
from vessel_hsmc_ros.nodes.control_concerns import ControlConcerns
from vessel_hsmc_ros.nodes.input_monitor import InputMonitor
from vessel_hsmc_ros.nodes.process import run_node
from vessel_hsmc_ros.nodes.step_clock import StepClock
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.law_file import load_named_files
from vessel_hsmc_ros.scenario.parameters import NODES, ControllerParameters

if TYPE_CHECKING:
    from rclpy.timer import Timer

REFERENCES_KEPT = 2000
"""Limit of the references that wait, in lockstep, for the odometry of their stamp; a reference ship is far less ahead."""

NOT_FOR_REAL_TIME = "law hierarchical tolerates no late control steps: in real time use another law, such as guided"

CHECK_PERIODS = {"lockstep": 0.4, "real time": 1.5}
"""Time between two checks of the inputs, s: in lockstep two of them take less than the plant's command_timeout."""


class ControllerNode(VesselNode):
    """Computes the wrench command from odometry and reference.

    Lockstep: every odometry message is answered by a command with the stamp of its step; that of late odometry is older. The law
    runs at the start of each control period, and its wrench is held (zero-order hold) for the odometry messages in between.

    Real time: a timer on the node's clock runs the law on the latest odometry, with the reference extrapolated to the stamp of
    the odometry. When either input is older than `input_timeout`, the wrench is zero.
    """

    NAME = "controller"

    def __init__(self, **options: Any) -> None:
        self.PARAMETERS = NODES[self.NAME]  # not of the class: files may add laws after its definition
        super().__init__(**options)
        p = self.parameters
        self._loop = make_control_loop(p)
        self.stamp = -1  # an event before step 0 takes effect at step 0
        self._start = 0
        self._phase: Timer | None = None
        self._odometry: tuple[int, Motion] | None = None
        self._steps = StepClock(self, self._answer)
        self._references: dict[int, tuple[Motion, Acceleration]] = {}
        self._inputs = InputMonitor(self, {"odom": "odometry", "reference": "reference"}, p.input_timeout)
        self._updates = 0
        self._compute_time = self._compute_time_max = 0.0
        self._health = ControlConcerns(self._loop, p.lockstep)
        self.black_box = installed(self, p.black_box, self.now)
        self._create_topics(p.lockstep)
        self.reporter.offer("reset", self._reset)
        self.reporter.offer_switch("enable", "disable", self._enable)
        self.create_timer(CHECK_PERIODS["lockstep" if p.lockstep else "real time"], self._check_inputs, clock=self._wall)

    def _create_topics(self, lockstep: bool) -> None:
        profile = qos.data(lockstep)
        self._command_out = self.advertise(WrenchStamped, "cmd_wrench", profile, partner=("odom", "allocated_wrench"))
        if lockstep:
            self.connections.allow_one_publisher("cmd_wrench")
        self._state_out = self.advertise(ControlState, "~/state", profile)
        if self._loop.observer:
            self._estimate_out = self.advertise(Odometry, "~/estimate", profile)
            self._estimate = self.framed(conversions.new_odometry())
        self._command = self.framed(conversions.new_wrench())
        self._state = self.framed(conversions.new_control_state())
        self.listen(Odometry, "odom", self._on_odometry, profile)
        self.listen(ReferenceState, "reference", self._on_reference, profile)

    def describe(self) -> str:
        """The law and its rate."""
        return f"law {self.parameters.law} at {self.parameters.rate_hz:g} Hz"

    def on_connected(self) -> None:
        """In lockstep, answer odometry received before the start; in real time, warn of a law that tolerates no delay."""
        if self.parameters.lockstep:
            self._answer()
        elif self.parameters.law == "hierarchical":
            self.get_logger().warning(NOT_FOR_REAL_TIME)

    # -- input --------------------------------------------------------------------------------------------------------

    def _on_odometry(self, message: Odometry) -> None:
        state = conversions.read_odometry(message)
        if wrong := conversions.not_finite(state):
            self._refuse(f"odometry with {wrong} is not allowed: all of it must be finite numbers")
            return
        self._odometry = conversions.nanoseconds(message.header.stamp), state
        self._inputs.receive("odometry", self._odometry[0], self.now())
        if self.parameters.lockstep:
            self._answer()
        elif self.connected and self._phase is None:
            self._lock_phase(self._odometry[0])

    def _on_reference(self, message: ReferenceState) -> None:
        reference, acceleration = conversions.read_reference(message)
        if wrong := conversions.not_finite(reference, acceleration):
            self._refuse(f"reference with {wrong} is not allowed: all of it must be finite numbers")
            return
        if not self.parameters.lockstep:
            self._references.clear()
        elif len(self._references) >= REFERENCES_KEPT:  # of stamps that no odometry has: the oldest will not be needed
            del self._references[next(iter(self._references))]
        stamp = conversions.nanoseconds(message.header.stamp)
        self._references[stamp] = reference, acceleration
        self._inputs.receive("reference", stamp, self.now())
        if self.parameters.lockstep:
            self._answer()

    def _refuse(self, reason: str) -> None:
        """Reject an input message: in lockstep the run cannot continue without it, in real time the next one replaces it."""
        if self.parameters.lockstep:
            raise ControlError(reason)
        self._inputs.refuse(reason)

    def _check_inputs(self) -> None:
        if self.connected:
            self._inputs.check(self._odometry[0] if self._odometry and self.parameters.lockstep else None)

    # -- lockstep -----------------------------------------------------------------------------------------------------

    def _answer(self) -> None:
        """Publish the command for the pending odometry as soon as the inputs of the law are complete."""
        if self._odometry is None or not self.connected:
            return
        measured_at, state = self._odometry
        if (stamp := self._steps.step_of(measured_at, self.stamp)) is None:
            return
        terms = None
        if self._loop.due(stamp):
            if stamp not in self._references:  # odometry and reference may arrive in either order
                return
            reference, acceleration = self._references[stamp]
            age = seconds(stamp - measured_at)
            terms = self._update(stamp, state, extrapolate(reference, acceleration, -age), acceleration, measured_at, age)
            self._references = {t: r for t, r in self._references.items() if t > stamp}
        self._odometry = None  # each odometry message is answered once, whatever references follow
        self._publish(stamp, terms)

    # -- real time ----------------------------------------------------------------------------------------------------

    def _lock_phase(self, stamp: int) -> None:
        """Start the timer so that it fires half a period away from the odometry.

        If both occurred at the same instant, the law would use the new odometry in one period and the previous one in the next,
        and a gain that is stable without delay may be unstable with a delay of a full period.
        """
        period = self._loop.grid.stamp(1)
        now = self.now()
        wait = (stamp + period // 2 - now) % period
        self._start = now + wait
        self._phase = self.create_timer(max(wait, 1) * 1e-9, self._start_timer)  # rclpy rejects a period of 0

    def _start_timer(self) -> None:
        self.destroy_timer(self._phase)
        self.create_timer(self._loop.grid.period, self._on_timer)

    def _on_timer(self) -> None:
        now = self.now()
        self._health.served(now)
        if not self._loop.due(now - self._start) or self._odometry is None or not self._references:
            return
        terms = None
        if missing := self._inputs.overdue(now):
            self._loop.skip(now - self._start)
            self._inputs.report_overdue(missing)
        else:
            terms = self._update_in_real_time(now - self._start, *self._odometry)
        self._publish(now, terms)

    def _update_in_real_time(self, elapsed: int, stamp: int, state: Motion) -> Terms | None:
        """Run the law on the latest odometry and the reference extrapolated to its stamp; where it has no value, command zero."""
        ((reference_stamp, (reference, acceleration)),) = self._references.items()
        reference = extrapolate(reference, acceleration, seconds(stamp - reference_stamp))
        late = elapsed + self._start - stamp  # less than a control period is sampling, not a delay
        age = seconds(late) if late >= self._loop.grid.stamp(1) else 0.0
        try:
            return self._update(elapsed, state, reference, acceleration, stamp, age)
        except LawError:  # an error in its code, after which its internal state cannot be trusted
            raise
        except ControlError as error:
            self._loop.skip(elapsed)
            self._inputs.report(f"{error}; the wrench is zero")
            return None

    def _update(
        self, stamp: int, state: Motion, reference: Motion, acceleration: Acceleration, measured_at: int, age: float
    ) -> Terms:
        began = time.perf_counter()  # wall time: the cost of the law, also on simulated time
        terms = self._loop.step(stamp, state, reference, acceleration, measured_at, age)
        self._compute_time = time.perf_counter() - began
        self._compute_time_max = max(self._compute_time_max, self._compute_time)
        self._updates += 1
        self._health.stepped(terms)
        return terms

    def _publish(self, stamp: int, terms: Terms | None) -> None:
        """Publish the wrench first, because the plant waits for it; then, once per control period, the terms of the law."""
        self.stamp = stamp
        time_stamp = conversions.time_message(stamp)
        conversions.write_wrench(self._command, time_stamp, self._loop.wrench)
        self.send(self._command_out, self._command)
        if terms is not None:
            conversions.write_terms(self._state, time_stamp, terms)
            self._state.compute_time = self._compute_time
            self._state.missed_periods = self._loop.missed_periods
            self.send(self._state_out, self._state)
            if self._loop.estimate is not None:
                conversions.write_odometry(self._estimate, time_stamp, self._loop.estimate)
                self.send(self._estimate_out, self._estimate)

    # -- services, parameters, diagnostics ----------------------------------------------------------------------------

    def retune(self, parameters: ControllerParameters) -> None:
        """Apply changed gains of the law; the network weights are kept.

        Raises:
            ParameterError: the law rejects the gains, for instance because they are unstable at its rate.
        """
        self._loop.retune(getattr(parameters, parameters.law))

    def _reset(self) -> str:
        self._loop.forget()
        return "weights and estimate are reset; time goes on"

    def _enable(self, enabled: bool) -> str:
        self._loop.enabled = enabled
        return "enabled" if enabled else "disabled: the wrench is zero"

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Updates, missed periods and computation time of the law; a warning or an error while an input is missing."""
        values = {
            "law": self.parameters.law,
            "updates": self._updates,
            "missed_periods": self._loop.missed_periods,
            "references_waiting": len(self._references),
            "compute_time": self._compute_time,
            "compute_time_max": self._compute_time_max,
        }
        level, message = self._inputs.status() or (OK, "running" if self._loop.enabled else "disabled")
        return level, message, values

    def concerns(self) -> list[Concern]:
        """Timing, saturation, surfaces, weights and numerical health besides the status."""
        return [*super().concerns(), *self._health.concerns(self.parameters.diagnostics)]


def main(arguments: list[str] | None = None) -> int:
    """Read the laws of every `--law-file FILE`, and run the node until a signal ends it."""
    return run_node(ControllerNode, arguments, take_options=load_named_files)


if __name__ == "__main__":
    sys.exit(main())
