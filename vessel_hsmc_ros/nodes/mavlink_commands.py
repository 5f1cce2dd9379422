"""The commands that the MAVLink node takes, by its form, and how an autopilot receives them."""

import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from geometry_msgs.msg import TwistStamped, WrenchStamped
from std_msgs.msg import Float64

from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.messages.mavlink import RELEASED, Pulses, axes, axis_width
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, DiagnosticTask, VesselNode
from vessel_hsmc_ros.nodes.command_input import CommandInput
from vessel_hsmc_ros.nodes.mavlink_link import Link
from vessel_hsmc_ros.safety.handover import Sticks

Shares = tuple[float, ...]


class Commands:
    """The commands of one form: the latest one, and its message.

    manual has the shares of force and moment, channels that of each thruster, and guided the share of the cruise speed and the
    yaw rate, rad/s.

    Args:
        node: The MAVLink node.
        link: Its connection.
        sticks: Takes what is sent for channels of the radio.
        refuse: Takes what is wrong with a command.
    """

    def __init__(self, node: VesselNode, link: Link, sticks: Sticks, refuse: Callable[[str], None]) -> None:
        p = self._p = node.parameters
        self._link, self._sticks, self._refuse = link, sticks, refuse
        self._pulses = Pulses(*p.pulses)
        self._thrusters = p.vessel.thrusters.thrusters()
        self._thrusts: dict[int, tuple[float, float]] = {}
        self._twist: tuple[float, tuple[float, float]] = -math.inf, (0.0, 0.0)
        self._input: CommandInput | None = None
        if p.form == "manual":
            self._input = CommandInput(node, "cmd_wrench", p.command_timeout)
            node.listen(WrenchStamped, "cmd_wrench", self._on_wrench, qos.NEWEST)
        elif p.form == "guided":
            node.listen(TwistStamped, "cmd_vel", self._on_velocity, qos.NEWEST)
        for topic, index, _ in p.vessel.thrusters.topics() if p.form == "channels" else ():
            node.listen(Float64, topic, partial(self._on_thrust, index), qos.NEWEST)
        self.nothing: Shares = (0.0,) * (len(p.channels) if p.form == "channels" else 2)

    def retune(self, parameters: Any) -> None:
        """Take a changed time-out."""
        self._p = parameters
        if self._input is not None:
            self._input.retune(parameters.command_timeout)

    def _on_wrench(self, message: WrenchStamped) -> None:
        if self._input is not None:
            self._input.take(message)

    def _on_velocity(self, message: TwistStamped) -> None:
        pair = message.twist.linear.x, message.twist.angular.z
        if all(map(math.isfinite, pair)):
            self._twist = time.monotonic(), pair
        else:
            self._refuse(f"cmd_vel = {pair} is not allowed: it takes finite numbers")

    def _on_thrust(self, index: int, message: Float64) -> None:
        if math.isfinite(message.data):
            self._thrusts[index] = time.monotonic(), message.data
        else:
            self._refuse(f"thrust = {message.data} is not allowed: it takes finite numbers")

    def present(self) -> Shares | None:
        """The command that holds now; None if there is none."""
        p, limit = self._p, time.monotonic() - self._p.command_timeout
        if self._input is not None:
            wrench = self._input.present()
            return wrench and (clip(wrench[0] / p.surge_force_limit, 1.0), clip(wrench[1] / p.yaw_moment_limit, 1.0))
        if p.form == "guided":
            at, (u, r) = self._twist
            return (clip(u / p.cruise_speed, 1.0), r) if at > limit else None
        given = [self._thrusts.get(i, (-math.inf, 0.0)) for i in range(len(self._thrusters))]
        if any(at <= limit for at, _ in given):
            return None
        return tuple(
            clip(thrust / ((t.thrust_ahead if thrust > 0.0 else t.thrust_astern) or t.thrust_ahead), 1.0)
            for t, (_, thrust) in zip(self._thrusters, given, strict=True)
        )

    def send(self, command: Shares) -> None:
        """Send a command to the autopilot."""
        p = self._p
        if p.form == "guided":
            self._link.velocity(command[0], -command[1])
            return
        if p.form == "channels":
            widths = {int(c): self._pulses.width(share) for c, share in zip(p.channels, command, strict=True)}
            self._link.override(widths)
        else:
            y, z = axes(*command)
            self._link.manual(y, z)
            widths = {int(c): axis_width(axis, p.radio_range) for c, axis in zip(p.stick_channels, (y, z), strict=True)}
        self._sticks.sent(time.monotonic(), widths)

    def give_back(self) -> None:
        """Give the channels back to the radio, which the commands of guided do not use."""
        if self._p.form != "guided":
            channels = self._p.channels if self._p.form == "channels" else self._p.stick_channels
            self._link.override({int(number): RELEASED for number in channels})

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """The state of the wrench, where it is the command."""
        if self._input is None:
            return []
        level, text = self._input.problem() or (OK, "fresh")
        return [DiagnosticTask("command", level, text, self._input.values())]
