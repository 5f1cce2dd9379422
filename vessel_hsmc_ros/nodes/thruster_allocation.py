"""The thrust-allocation node: turns the commanded wrench into demands for single thrusters."""

import math
from itertools import cycle
from typing import Any

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64

from vessel_hsmc_ros.control.loop.allocation import Allocated, Allocation
from vessel_hsmc_ros.core.exceptions import ParameterError, SimulationError
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ERROR, LAST_COMMANDS, OK, WARN, DiagnosticTask, VesselNode
from vessel_hsmc_ros.nodes.commands import Command, CommandInput, is_finite, is_nothing, nothing
from vessel_hsmc_ros.nodes.controller_inputs import read_odometry
from vessel_hsmc_ros.scenario.parameters import AllocationParameters

CHECK_PERIOD = 0.05  # time between two checks for an overdue command, s
LONGEST_STEP = 1_000_000_000
"""Period of the slowest plant, ns: a stamp that is further ahead of the last one is not that of the next step."""


class ThrusterAllocationNode(VesselNode):
    """Allocates the commanded wrench to the thrusters, and publishes a thrust and, where it turns, an angle for each.

    Every command is answered at once. A wrench that is out of reach is answered by the nearest one, moment before force, and the
    diagnostics report it as saturated. In real time a command that is not fresh is refused, and all thrusts are zero when the
    latest one is older than `command_timeout`, where two nodes command, and at the end.
    """

    NAME = "thruster_allocation"
    INTERFACE = """
        subscribes to  cmd_wrench, odom (with rudders)
        publishes      thrusters/<name>/thrust, thrusters/<name>/angle (of azimuths and rudders), allocated_wrench, events,
                       thrusters/<name>/shaft_speed (where its thrust coefficients are given)
        services       ~/reset
    """
    PARAMETERS = AllocationParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._layout = self.parameters.vessel.thrusters
        if not self._layout:
            raise ParameterError("thruster_allocation.vessel.thrusters.names must name at least one thruster (got [''])")
        self._allocation = Allocation(self._layout)
        self._input = CommandInput(self, "cmd_wrench", self.parameters.command_timeout)
        self._pending: list[tuple[int, Command | None]] = []
        self._unanswered: Command | None = None
        self._speeds: list[float] = []
        self._speed = 0.0
        self._commands = self._saturated = self._timeouts = 0
        self._is_saturated = False
        self._is_stopped = True
        self._create_topics(self.parameters.lockstep)
        self.reporter.offer("reset", self._reset)
        if not self.parameters.lockstep:
            self.create_timer(CHECK_PERIOD, self._check_age, clock=self.wall)

    def _create_topics(self, lockstep: bool) -> None:
        profile = qos.data(lockstep)
        self._demands_out = [
            (self.advertise(Float64, topic, profile, partner="odom"), i, part) for topic, i, part in self._layout.topics()
        ]
        thrusters = self._layout.thrusters()
        # Not advertised: hardware may take these, but no node of the loop does, and the start must not wait for one.
        self._speeds_out = [
            (self.create_publisher(Float64, f"thrusters/{t.name}/shaft_speed", profile), i, t)
            for i, t in enumerate(thrusters)
            if t.thrust_coefficient_ahead and t.thrust_coefficient_astern
        ]
        self._wrench_out = self.advertise(WrenchStamped, "allocated_wrench", profile)
        self._wrench = self.framed(conversions.new_wrench())
        self._needs_speed = self._layout.needs_speed
        self.listen(WrenchStamped, "cmd_wrench", self._on_command, qos.newest(lockstep))
        if self._needs_speed:
            self.listen(Odometry, "odom", self._on_odometry, qos.newest(lockstep))

    def describe(self) -> str:
        """The thrusters."""
        named = zip(self._layout.thrusters(), cycle(self._layout.kinds), strict=False)
        return f"thrusters {', '.join(f'{thruster.name} ({kind})' for thruster, kind in named)}"

    def on_connected(self) -> None:
        """Answer the commands that were received before the start."""
        self._answer()

    def _on_odometry(self, message: Odometry) -> None:
        speed = read_odometry(message, self.parameters.odometry.twist_frame).motion.u
        if self.parameters.lockstep:
            self._speeds.append(speed)
            self._answer()
        elif math.isfinite(speed):
            self._speed = speed

    def _on_command(self, message: WrenchStamped) -> None:
        stamp = conversions.nanoseconds(message.header.stamp)
        if self.parameters.lockstep:
            self._on_step(stamp, message)
        elif self._input.take(message):
            self._is_stopped = False
            self._pending.append((stamp, conversions.read_wrench(message)))
        self._answer()

    def _on_step(self, stamp: int, message: WrenchStamped) -> None:
        """Lockstep: take a command; one with a later stamp than all before is the answer to the next step."""
        answers = self._is_stopped or self.stamp < stamp <= self.stamp + LONGEST_STEP
        if answers:
            self._is_stopped, self.stamp = False, stamp
        if not is_nothing(message):
            if self._input.take(message):
                self._unanswered = conversions.read_wrench(message)
        elif not self.parameters.ride_through:
            remedy = "thruster_allocation.ride_through=true goes on without it"
            raise SimulationError(f"no command came for t = {seconds(stamp):g} s: {remedy}")
        if answers:
            self._pending.append((stamp, self._unanswered))
            self._unanswered = None

    def _answer(self) -> None:
        """Answer the pending commands; with rudders, in lockstep, once the odometry that they answer has come."""
        while self.connected and self._pending:
            stamp, command = self._pending[0]
            if self._needs_speed and self.parameters.lockstep and not self._speeds:
                return
            del self._pending[0]
            self._publish(stamp, command)

    def _publish(self, stamp: int, command: Command | None) -> None:
        if self.parameters.lockstep:  # each message is answered by one command; late odometry does not have its stamp
            speed = self._speeds.pop(0) if self._speeds else 0.0
            self._speed = speed if math.isfinite(speed) else self._speed
        if command is None:
            self._publish_nothing(stamp)
            return
        given = self._allocated(stamp, command)
        self._commands += 1
        self._saturated += given.saturated
        self._is_saturated = given.saturated
        for publisher, i, part in self._demands_out:
            self.send(publisher, Float64(data=(given.thrust, given.angle)[part][i]))
        conversions.write_body_wrench(self._wrench, conversions.time_message(stamp), given.wrench)
        self.send(self._wrench_out, self._wrench)
        for publisher, i, thruster in self._speeds_out:
            self.send(publisher, Float64(data=thruster.shaft_speed(given.thrust[i])))

    def _allocated(self, stamp: int, command: Command) -> Allocated:
        """The demands for a command; without thrust, and reported, where they are not finite, as for an absurd speed."""
        given = self._allocation.step_at(stamp, command, self._speed)
        if not is_finite((*given.thrust, *given.angle, *given.wrench)):
            self.refuse(
                f"demands must be finite numbers (got others for {command} N, N·m at {self._speed} m/s): no thrust is given"
            )
            self._allocation.reset()
            return self._allocation.step(0.0, 0.0, 0.0)
        return given

    def _publish_nothing(self, stamp: int) -> None:
        """Lockstep: pass on that no command of a step has come; the thrust is zero once the last one does not hold any more."""
        held = self._input.present() is not None
        if not held:
            self._allocation.stop()
        for publisher, _, part in self._demands_out:
            self.send(publisher, Float64(data=math.nan if held or part else 0.0))
        self.send(self._wrench_out, nothing(stamp))

    def _check_age(self) -> None:
        """Real time: set all thrusts to zero when no command holds any more; angles hold."""
        if self._is_stopped or self._input.present() is not None:
            return
        self._is_stopped = True
        self._timeouts += 1
        self._send_no_thrust()
        _, why = self._input.problem() or (WARN, f"no command for {self.parameters.command_timeout:g} s")
        self.get_logger().warning(f"{why}: the thrust is zero")

    def _send_no_thrust(self) -> None:
        self._allocation.stop()
        thrusts = [publisher for publisher, _, part in self._demands_out if part == 0]
        for publisher in (*thrusts, *(publisher for publisher, *_ in self._speeds_out)):
            self.send(publisher, Float64(data=0.0))

    def retune(self, parameters: AllocationParameters) -> None:
        """Take a changed time-out."""
        self._input.retune(parameters.command_timeout)

    def _reset(self) -> str:
        self._allocation.reset()
        return "thrusts are zero and angles straight; time goes on"

    def close(self) -> None:
        """In real time, leave the thrusters without thrust: their drivers may hold the last demand."""
        if self.connected and not self.parameters.lockstep and not self._is_stopped:
            for _ in range(LAST_COMMANDS):
                self._send_no_thrust()
        super().close()

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Numbers of answered, saturated and ignored commands."""
        values = {
            "commands": self._commands,
            "saturated": self._is_saturated,
            "saturated_commands": self._saturated,
            "ignored_commands": self._input.values()["refused"],
            "timeouts": self._timeouts,
        }
        if self.problem.current:
            return *self.problem.current, values
        problem = self._input.problem()
        if problem and (self._commands or problem[0] == ERROR):
            level, text = problem
            return level, f"{text}: the thrust is zero" if self._is_stopped else text, values
        if not self._commands:
            return OK, f"waiting for a command on {self.resolve_topic_name('cmd_wrench')}", values
        return OK, "saturated: the nearest wrench is given" if self._is_saturated else "running", values

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """The status, and that of the commands."""
        own, *_ = super().diagnostic_tasks()
        text = "fresh" if own.level == OK else own.message
        return [own, DiagnosticTask("command", own.level, text, self._input.values())]
