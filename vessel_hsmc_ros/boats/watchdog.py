"""The watchdog node: passes commands on while they are fresh, and reports nodes that have fallen silent."""

import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped

from vessel_hsmc_ros.boats.parameters import WatchdogParameters
from vessel_hsmc_ros.boats.takeover import PassingNode, StopLatch
from vessel_hsmc_ros.core.kernel import clip
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ERROR, LAST_COMMANDS, OK, DiagnosticTask
from vessel_hsmc_ros.nodes.commands import Command, CommandInput, finite


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
        publishes      watched_wrench
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
        for name in conversions.read_status(message, self._prefix).keys() & self._heard_at.keys():
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
