"""The drive node: gives commands the form that a stack takes, with a time-out, a ramp and zero at the end.

The watchdog node: passes commands on while they are fresh, and reports nodes that have fallen silent.
"""

import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped, WrenchStamped
from rclpy.duration import Duration
from std_msgs.msg import Float64, UInt16
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats.parameters import DriveParameters, WatchdogParameters
from vessel_hsmc_ros.boats.takeover import PassingNode, StopLatch
from vessel_hsmc_ros.core.kernel import between, clip
from vessel_hsmc_ros.core.thruster_layout import HIGHEST, LOWEST
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ACKNOWLEDGE_LIMITS, ERROR, LAST_COMMANDS, OK, DiagnosticTask
from vessel_hsmc_ros.nodes.commands import Command, CommandInput, UnstampedInput, finite, is_finite


class DriveNode(PassingNode):
    """Takes `cmd_wrench`, in the form pwm the thrusts of thruster_allocation, and publishes it in the form of a stack.

    normalised and helm: shares of the largest force and moment. cmd_vel: surge speed and yaw rate, for stacks with loops of their
    own for them: those that the guidance of the law commands or, with a `response_time` T of the loops, those with which the
    loops give the commanded wrench, u + T·tau_1/m11 and r + T·tau_2/m33. A law without these terms cannot drive it. pwm: pulse
    widths of the thrusters by a measured curve.

    The output is share·command within the limits. The share goes to 0 in `ramp_time` when commands are not fresh or the law does
    not command, back to 1 in the same time when they are, and is 0 from `~/stop` until `~/rearm`. At zero without fresh commands,
    as with a controller in standby, the topic is left to others.
    """

    NAME = "drive"
    REAL_TIME = "a drive works"
    INTERFACE = """
        subscribes to  cmd_wrench, thrusters/<name>/thrust (with the form pwm), controller/state (with cmd_vel)
        publishes      normalised_wrench, cmd_vel, throttle, steering, thrusters/<name>/pwm (by its form), events
        services       ~/stop, ~/rearm
    """
    PARAMETERS = DriveParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._curve = p.pwm.curve()
        if p.form == "pwm":
            topics = [f"thrusters/{name}/thrust" for name in p.pwm.thrusters]
            self._input = UnstampedInput(self, Float64, topics, p.command_timeout)
        else:
            self._input = self.take_wrench()
        self._state: ControlState | None = None
        self._command: tuple[float, ...] = (0.0,) * (len(p.pwm.thrusters) if p.form == "pwm" else 2)
        self._latch = StopLatch(self, "the output", self._send_zero)
        self._zeros = LAST_COMMANDS
        self._sent = 0
        self._outputs = self._advertise(p.form)
        if p.form == "cmd_vel":
            self.listen(ControlState, "controller/state", self._on_state, qos.NEWEST)
        self.create_timer(1.0 / p.rate_hz, self._on_timer, clock=self.wall)

    def _advertise(self, form: str) -> dict[str, Any]:
        kinds = {
            "normalised": {"normalised_wrench": WrenchStamped},
            "cmd_vel": {"cmd_vel": TwistStamped if self.parameters.stamped else Twist},
            "helm": {"throttle": Float64, "steering": Float64},
            "pwm": {f"thrusters/{name}/pwm": UInt16 for name in self.parameters.pwm.thrusters},
        }
        profile = qos.offered(False, self.parameters.rate_hz)
        return {topic: self.advertise(kind, topic, profile) for topic, kind in kinds[form].items()}

    def describe(self) -> str:
        """The form and its limits."""
        p = self.parameters
        if p.form == "pwm":
            least, most = self._curve.thrusts[0], self._curve.thrusts[-1]
            return f"form pwm, thrusts to {most:g} N ahead and {-least:g} N astern, neutral {p.pwm.neutral:g} µs"
        limits = (
            f"{p.surge_speed_limit:g} m/s and {p.yaw_rate_limit:g} rad/s"
            if p.form == "cmd_vel"
            else f"1 is {p.surge_force_limit:g} N and {p.yaw_moment_limit:g} N·m"
        )
        return f"form {p.form}, {limits}, time-out {p.command_timeout:g} s, ramp {p.ramp_time:g} s"

    def _on_state(self, message: ControlState) -> None:
        self._state = message

    def _wanted(self) -> tuple[float, ...] | None:
        """The command in the units of the form and within its limits; None if there is none that counts."""
        wrench, p = self._input.present(), self.parameters
        if wrench is None or self._latch.stopped:
            return None
        if p.form == "pwm":
            least, most = min(self._curve.thrusts[0], 0.0), max(self._curve.thrusts[-1], 0.0)
            return tuple(between(thrust, least, most) for thrust in wrench)
        if p.form != "cmd_vel":
            return p.shares(wrench)
        return self._velocity((wrench[0], wrench[1]))

    def _velocity(self, wrench: Command) -> Command | None:
        """Surge speed and yaw rate while the law commands."""
        state, p = self._state, self.parameters
        age = math.inf if state is None else seconds(self.now() - conversions.nanoseconds(state.header.stamp))
        if state is None or not -p.freshness.future_tolerance <= age <= p.command_timeout:
            topic = self.resolve_topic_name("controller/state")
            self.refuse(f"no recent message on {topic}, which has the surge speed and the yaw rate for cmd_vel")
            return None
        if state.operation != ControlState.ACTIVE:
            return None
        u, r, lacking = state.commanded_surge_velocity, state.commanded_yaw_rate, "surge speed and yaw rate"
        if p.response_time:
            # By the surfaces, the difference of the motion and what is commanded, the motion itself is known.
            force, moment = wrench
            u += state.surge_surface + p.response_time * force / p.surge_inertia
            r += state.yaw_surface + p.response_time * moment / p.yaw_inertia
            lacking = "surge speed and yaw rate with their surfaces, which response_time > 0 needs"
        if not is_finite((u, r)):
            self.refuse(f"the law commands no {lacking}: for cmd_vel use one that does, such as guided")
            return None
        return clip(u, p.surge_speed_limit), clip(r, p.yaw_rate_limit)

    def _on_timer(self) -> None:
        wanted = self._wanted()
        share = self._latch.update(wanted is not None)
        if wanted is not None:
            self._command = wanted
        if wanted is None and not share and not self._latch.stopped:
            if self._zeros >= LAST_COMMANDS:
                return
            self._zeros += 1
        else:
            self._zeros = 0
        self._publish(tuple(share * part for part in self._command))

    def _publish(self, command: tuple[float, ...]) -> None:
        p, command = self.parameters, finite(command, self.refuse)
        if p.form == "pwm":
            for publisher, thrust, sign in zip(self._outputs.values(), command, p.pwm.signs(), strict=True):
                pulse = p.pwm.neutral + sign * (self._curve.pulse(thrust) - p.pwm.neutral)
                self.send(publisher, UInt16(data=round(between(pulse, LOWEST, HIGHEST))))
            self._sent += 1
            return
        a, b = command
        stamp = self.get_clock().now().to_msg()
        if p.form == "normalised":
            message = self.framed(conversions.new_wrench())
            conversions.write_wrench(message, stamp, (float(a), float(b) * p.steering_sign))
            self.send(self._outputs["normalised_wrench"], message)
        elif p.form == "cmd_vel":
            frame = p.frame_prefix + conversions.BODY
            self.send(self._outputs["cmd_vel"], conversions.velocity_command((a, b), frame, stamp if p.stamped else None))
        else:
            self.send(self._outputs["throttle"], Float64(data=float(a)))
            self.send(self._outputs["steering"], Float64(data=float(b) * p.steering_sign))
        self._sent += 1

    def _send_zero(self) -> None:
        self._command = (0.0,) * len(self._command)
        self._publish(self._command)

    def close(self) -> None:
        """Leave the drives without a command: zero, several times."""
        if self.connected and (self._latch.share or self._zeros < LAST_COMMANDS):
            for _ in range(LAST_COMMANDS):
                self._send_zero()
            for publisher in self._outputs.values():
                publisher.wait_for_all_acked(Duration(nanoseconds=round(ACKNOWLEDGE_LIMITS["real time"] * NANOSECONDS)))
        super().close()

    def values(self) -> dict[str, Any]:
        """The number of commands sent."""
        return {"sent": self._sent}


class WatchdogNode(PassingNode):
    """Passes `cmd_wrench` on as `watched_wrench` while it is fresh; otherwise the wrench ramps to zero.

    For thruster drivers without a time-out of their own. It runs in a process of its own, so that it outlives the controller,
    and at its end it leaves zero. A driver notices its death only by the end of `watched_wrench`, which has the rate of the
    commands, or else `rate_hz`.

    The output is share·command, within the limits. The share goes from 1 to 0 in `ramp_time` when the commands are not fresh,
    back to 1 in the same time when they are, and is 0 from `~/stop` until `~/rearm`.
    """

    NAME = "watchdog"
    REAL_TIME = "a watchdog works"
    INTERFACE = """
        subscribes to  cmd_wrench, /diagnostics
        publishes      watched_wrench, events
        services       ~/stop, ~/rearm
    """
    PARAMETERS = WatchdogParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._input = CommandInput(self, "cmd_wrench", p.command_timeout)
        self._command: Command = (0.0, 0.0)
        self._prefix = f"{self.get_namespace().strip('/')}/".lstrip("/")
        self._heard_at = {name: time.monotonic() for name in p.watched_nodes if name}
        self._wrench_out = self.advertise(WrenchStamped, "watched_wrench", qos.offered(False, p.rate_hz))
        self._wrench = self.framed(conversions.new_wrench())
        self._latch = StopLatch(self, "the wrench", self._publish, share=1.0)
        self.listen(WrenchStamped, "cmd_wrench", self._on_command, qos.NEWEST)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, qos.DIAGNOSTICS)
        self.create_timer(1.0 / p.rate_hz, self._on_timer, clock=self.wall)

    def describe(self) -> str:
        """The time-outs and the watched nodes."""
        p = self.parameters
        nodes = ", ".join(self._heard_at) or "no node"
        return f"time-out {p.command_timeout:g} s, ramp {p.ramp_time:g} s, watches {nodes} for {p.heartbeat_timeout:g} s"

    def _on_command(self, message: WrenchStamped) -> None:
        if self._input.take(message):
            p, (force, moment) = self.parameters, conversions.read_wrench(message)
            self._command = clip(force, p.surge_force_limit), clip(moment, p.yaw_moment_limit)
            self._publish()

    def _on_timer(self) -> None:
        """Publish on the way to zero and at zero; fresh commands are published as they come."""
        if self._is_fresh():
            self._latch.update(True)  # so that the ramp begins at the time-out, not at the last command
        else:
            self._publish()

    def _is_fresh(self) -> bool:
        return not self._latch.stopped and self._input.present() is not None

    def _publish(self) -> None:
        share, (force, moment) = self._latch.update(self._is_fresh()), self._command
        self._send((share * force, share * moment), self.now())

    def _send(self, wrench: Command, stamp: int) -> None:
        force, moment = finite(wrench, self.refuse)
        conversions.write_wrench(self._wrench, conversions.time_message(stamp), (force, moment))
        self.send(self._wrench_out, self._wrench)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for name in conversions.read_status(message.status, self._prefix).keys() & self._heard_at.keys():
            self._heard_at[name] = time.monotonic()

    def close(self) -> None:
        """Leave the driver without a command: zero, several times."""
        now = self.now()
        for number in range(LAST_COMMANDS if self.connected else 0):  # a second command of one stamp would be refused
            self._send((0.0, 0.0), now + number)
        super().close()

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """Those of the commands, and the heartbeats."""
        ages = {name: time.monotonic() - at for name, at in self._heard_at.items()}
        silent = [f"{name} for {age:.1f} s" for name, age in ages.items() if age > self.parameters.heartbeat_timeout]
        heartbeat = (ERROR, f"no diagnostics of {', '.join(silent)}") if silent else (OK, "all nodes are alive")
        if silent:
            self.get_logger().error(heartbeat[1], throttle_duration_sec=5.0)
        values = {f"{name}_age": age for name, age in ages.items()}
        return [*super().diagnostic_tasks(), DiagnosticTask("heartbeat", *heartbeat, values)]
