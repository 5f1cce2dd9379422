"""The plant-simulator node: subscribes to the wrench, publishes odometry and, in lockstep, the simulation time on /clock."""

import sys
import time
from typing import Any

from geometry_msgs.msg import AccelStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.hull import vessel_name
from vessel_hsmc_ros.core.timing import NANOSECONDS, RateGrid, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.codec import Draft
from vessel_hsmc_ros.messages.conversions import Outgoing
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WARN, DiagnosticTask, VesselNode
from vessel_hsmc_ros.nodes.odometry_output import transform_publisher
from vessel_hsmc_ros.nodes.pace import Pace
from vessel_hsmc_ros.plant.dynamics import Wrench
from vessel_hsmc_ros.plant.hull_parameters import bounded
from vessel_hsmc_ros.plant.simulator import Simulator
from vessel_hsmc_ros.plant.thruster_plant import make_plant
from vessel_hsmc_ros.scenario.parameters import SimParameters
from vessel_sim_node.drives import BEFORE_START, FleetClock, OtherLoop, ThrusterDrive, WrenchDrive


class GroundTruth:
    """Publishers of the ground truth, for which no node waits."""

    def __init__(self, node: VesselNode, plant: Simulator, profile: Any) -> None:
        self._node, self._plant = node, plant
        self._disturbance_out = node.advertise(WrenchStamped, "disturbance", profile)
        self._dynamics_out = node.advertise(AccelStamped, "dynamics/truth", profile)
        self._disturbance = Outgoing(node.framed(conversions.new_wrench()), conversions.BODY_WRENCH)
        self._dynamics = Outgoing(node.framed(conversions.new_acceleration()), conversions.ACCELERATION)
        if not plant.odometry_is_true:
            self._state_out = node.advertise(Odometry, "odom/truth", profile)
            self._state = Outgoing(node.framed(conversions.new_odometry()), conversions.ODOMETRY)

    def publish(self, stamp: int, time: float) -> Wrench:
        """Publish the ground truth of a step."""
        load = self._plant.disturbance(time)
        self._node.send(self._disturbance_out, self._disturbance(stamp, load))
        self._node.send(self._dynamics_out, self._dynamics(stamp, self._plant.unforced_acceleration()))
        if not self._plant.odometry_is_true:
            self._node.send(self._state_out, self._state(stamp, self._plant.state))
        return load


class VesselSimNode(VesselNode):
    """Integrates the ship's motion and publishes it; a wrench drives the ship, or the demands of its thrusters.

    Lockstep: publishes step k and takes the next one when the command stamped k has been received. Real time: a timer sets the
    pace and the latest command is held until its time-out, then the wrench is zero. Overdue steps are taken at once; after a stop
    of its process or a step of its clock the ship goes on from where it is.
    """

    NAME = "vessel_sim"
    INTERFACE = """
        subscribes to  cmd_wrench, thrusters/<name>/thrust, thrusters/<name>/angle (with actuators.kind = thrusters)
        publishes      odom, applied_wrench, disturbance, dynamics/truth, odom/truth (with sensor noise), events,
                       /clock (in lockstep)
        services       ~/pause, ~/reset
    """
    PARAMETERS = SimParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._grid = RateGrid(p.rate_hz)
        self._plant = make_plant(p, self._grid.period)
        self._last_step = round(p.duration * p.rate_hz) if p.duration else sys.maxsize
        self._step = 0
        self._pace = Pace(self, self._grid)
        self._paused = False
        self._answer_at = self._wall_start = self._wall_seconds = 0.0
        self._limited_hull, self._outside = bounded(p.vessel), ""
        self._drive: Any = (ThrusterDrive if p.by_thrusters else WrenchDrive)(self, self._on_answer)
        self._create_topics()
        self.reporter.offer("reset", self._reset)
        self.reporter.offer_switch("pause", "resume", self._pause)

    def _create_topics(self) -> None:
        lockstep = self.parameters.lockstep
        profile, offered = qos.data(lockstep), qos.offered(lockstep, self.parameters.rate_hz)
        partners = dict.fromkeys(("cmd_wrench", *self._drive.topics))
        self._odometry_out = self.advertise(Odometry, "odom", offered, partner=tuple(partners))
        if (
            lockstep and self.parameters.by_thrusters and self.parameters.vessel.thrusters.needs_speed
        ):  # the allocation reads it too
            self.connections.add_publisher(self._odometry_out, "cmd_wrench")
            self.connections.add_publisher(self._odometry_out, "allocated_wrench")
        follows = lockstep and self.parameters.clock.source == "follow"
        self._applied_out = self.advertise(WrenchStamped, "applied_wrench", profile, partner="/clock" if follows else ())
        self._truth = GroundTruth(self, self._plant, profile)
        self._odometry = Outgoing(self.framed(conversions.new_odometry()), conversions.ODOMETRY)
        self._applied = Outgoing(self.framed(conversions.new_wrench()), conversions.BODY_WRENCH)
        self._tick = Draft(Clock(), ("clock.sec", "clock.nanosec"))
        self.connections.allow_one_publisher("odom")
        self._publish_transform = transform_publisher(self)
        self._clock_out: Any = None
        self._fleet: FleetClock | None = None
        if lockstep:
            for topic in self._drive.topics:
                self.connections.allow_one_publisher(topic)
            self.connections.add_condition(OtherLoop(self._drive).sign)
            self._create_clock(follows)
            # A wall-clock timer: simulated time stands still while the command is awaited.
            self.create_timer(0.1, self._check_lockstep, clock=self.wall)

    def _create_clock(self, follows: bool) -> None:
        """Lockstep: publish /clock, unless this plant follows that of another; in a fleet, wait for the others at each step."""
        if follows or self.parameters.clock.others:
            self._fleet = FleetClock(self, () if follows else self.parameters.clock.others)
        if not follows:
            self.connections.allow_one_publisher("/clock")
            self._clock_out = self.advertise(Clock, "/clock", qos.CLOCK_OF_LOCKSTEP)

    def describe(self) -> str:
        """The ship, the rate and the length of the run."""
        duration = f", {self.parameters.duration:g} s" if self.parameters.duration else ""
        ship = vessel_name(self.parameters.vessel)
        return f"plant{f' of {ship}' if ship else ''} at {self.parameters.rate_hz:g} Hz{duration}"

    def on_connected(self) -> None:
        """Publish the first step."""
        self._wall_start = self._answer_at = time.monotonic()
        if not self.parameters.lockstep:
            # Connecting the nodes takes time; the run begins when it is complete.
            self._pace.run(self._on_timer)
        if self._fleet:
            self._fleet.wait(BEFORE_START, 0, self._begin_step)
        else:
            self._begin_step()

    def _begin_step(self) -> None:
        """Publish a step as a whole: the first one, and in a fleet each one when all vessels are ready for it."""
        self._answer_at = time.monotonic()
        self._publish_motion()
        self._publish_truth()

    def _publish_motion(self) -> None:
        self.stamp = self._pace.stamp(self._step)
        measured = self._plant.measured(self._grid.stamp(self._step))
        measured_at = self._pace.stamp(self._step - self._plant.periods_late)
        odometry = self._odometry(measured_at, measured)
        self.send(self._odometry_out, odometry)
        if self.parameters.publish_tf:
            self._publish_transform(deserialize_message(odometry, Odometry))
        if self._clock_out:
            self.send(self._clock_out, self._tick(divmod(self.stamp, NANOSECONDS)))

    def _publish_truth(self) -> None:
        """Publish what no sensor measures, and keep the disturbance of this step."""
        self._load = self._truth.publish(self.stamp, seconds(self._grid.stamp(self._step)))

    def _finish_step(self, command: Any) -> None:
        """Apply a command to the present step and advance to the next; odometry first, because the controller waits for it."""
        wrench = self._drive.apply(self._plant, command)
        finished = self.stamp
        last = self._step >= self._last_step
        if not last:
            self._plant.advance(wrench, self._load)
            self._step += 1
            if not self._fleet:
                self._publish_motion()
            if self._limited_hull and not self._outside:
                self._check_speeds()
        self.send(self._applied_out, self._applied(finished, wrench))
        if self._fleet and last:
            self._fleet.wait_for_end(finished, self._finish)
        elif self._fleet:
            self._fleet.wait(finished, self._grid.stamp(self._step), self._begin_step)
        elif last:
            self._finish()
        else:
            self._publish_truth()

    def _check_speeds(self) -> None:
        """Warn once of a velocity for which the hull data do not hold."""
        found = self._plant.outside_hull_data()
        if found:
            self._outside = f"{found}, at t = {seconds(self._grid.stamp(self._step)):g} s"
            self.get_logger().warning(f"the ship has {self._outside}: the motion is extrapolated")

    def _finish(self) -> None:
        self.finished = True
        self._wall_seconds = time.monotonic() - self._wall_start
        simulated = seconds(self._grid.stamp(self._step))
        self.get_logger().info(f"finished: {self._step} steps, {simulated:g} s in {self._wall_seconds:.2f} s")

    def _on_answer(self) -> None:
        """Lockstep: the command of the present step has come."""
        self._answer_at = time.monotonic()
        self._go_on()

    def _go_on(self) -> None:
        """Lockstep: take the step whose command has been received, unless paused."""
        if self._drive.answer is not None and not self._paused:
            command, self._drive.answer = self._drive.answer, None
            self._finish_step(command)

    def _check_lockstep(self) -> None:
        """Lockstep: end the run when the command for the present step is overdue."""
        if self._fleet and self._fleet.waiting:
            if lost := self._fleet.lost():
                raise SimulationError(
                    f"no node publishes {lost} any more, for which this plant waits at t = {seconds(self.stamp):g} s"
                )
            return
        waited = time.monotonic() - self._answer_at
        limit = self.parameters.command_timeout
        if self.connected and not self._paused and self._drive.answer is None and waited > limit:
            found = f"no command came for t = {seconds(self.stamp):g} s within {limit:g} s: is the controller alive?"
            raise SimulationError(self.connections.conflict() or found)

    def _on_timer(self) -> None:
        """Real time: take every step that is due; a command holds from the odometry it answers, as in lockstep."""
        if self._paused:  # a pause shifts the start, so that no steps are overdue after it
            self._pace.hold(self._step)
        due, moved = self._pace.due(self._step)
        if moved:  # what was received before is by another time
            self._drive.reset()
            self.get_logger().warning(f"{moved}: the ship goes on from where it is")
        if self._step < due:
            command = self._drive.present()
        while self._step < due and not self.finished:
            self._finish_step(command)

    def retune(self, parameters: SimParameters) -> None:
        """Take changed disturbances from the next step on."""
        self._plant.retune(parameters.disturbance, seconds(self._grid.stamp(self._step)))

    def _reset(self) -> str:
        self._plant.reset()
        return "the ship is back at its start; time goes on"

    def _pause(self, paused: bool) -> str:
        self._paused = paused
        self._answer_at = time.monotonic()  # the time-out of a command begins anew
        if self.parameters.lockstep and self.connected:
            self._go_on()
        return "paused" if paused else "running"

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Progress and real-time factor of the run, for the diagnostics."""
        simulated = seconds(self._grid.stamp(self._step))
        wall = self._wall_seconds if self.finished else time.monotonic() - self._wall_start
        message = "finished" if self.finished else "paused" if self._paused else "running"
        level = OK if message in ("running", "finished") else WARN
        if message == "running" and not self.parameters.lockstep:
            level, message = self._drive.problem() or (level, message)
        values = {
            "simulated_time": simulated,
            "steps": self._step,
            "duration": self.parameters.duration,
            "wall_time": wall,
            "real_time_factor": simulated / wall if self.connected and wall else 0.0,
            "first_command_at": self._drive.first_command_at,
            "moves": self._pace.moves,
            "outside_hull_data": self._outside,
        }
        return (WARN if level == OK and self._outside else level), message, values

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """The status, and that of the commands."""
        level, text = (None if self.finished or self._paused else self._drive.problem()) or (OK, "fresh")
        hull = DiagnosticTask("hull data", WARN if self._outside else OK, self._outside or "within their range", {})
        pace = DiagnosticTask("pace", OK, f"{self._pace.moves} times behind or set", {"moves": self._pace.moves})
        return [*super().diagnostic_tasks(), DiagnosticTask("command", level, text, self._drive.values()), hull, pace]
