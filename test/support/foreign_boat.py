"""A boat and its stack without code of the package: physics, sensors and drives as other programs have them.

    python test/support/foreign_boat.py --state odometry --frame map --best-effort --rate 5 20 --loss 0.1 --command wrench

Every second it prints its place and its distance from `reference/pose`, and at the end the rms of that distance.
"""

import argparse
import contextlib
import math
import random
import sys
from typing import Any

import rclpy
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, NavSatFix
from std_msgs.msg import Float64, UInt16

STEP = 0.01
MASS, INERTIA = (550.0, 700.0), 700.0  # with added mass: surge, sway [kg]; yaw [kg·m²]
DRAG = (70.0, 300.0, 400.0)  # surge, sway [N·s/m]; yaw [N·m·s]
FORCE, MOMENT = 300.0, 250.0
TIMEOUT = 1.0
ORIGIN = (59.9, 10.7)
LEVER, THRUST, NEUTRAL, DEADBAND, SPAN = 0.8, 150.0, 1500.0, 25.0, 400.0
"""Two thrusters, port and starboard: distance from the centreline [m], thrust [N], and pulses of their controllers [µs]."""

ANTENNA = 1.0
"""Distance of the GNSS antenna ahead of the origin of the boat, m."""


class Boat(Node):
    """Integrates the motion of the boat, publishes a form of state, and takes a form of command."""

    def __init__(self, options: argparse.Namespace) -> None:
        super().__init__("foreign_boat")
        self.o = options
        self.state = [0.0] * 6
        self.drive = (0.0, 0.0)
        self.driven_at = -math.inf
        self.reference: tuple[float, float] | None = None
        self.errors: list[float] = []
        self.random = random.Random(1)  # noqa: S311 - not for cryptography
        reliability = ReliabilityPolicy.BEST_EFFORT if options.best_effort else ReliabilityPolicy.RELIABLE
        self.sensor = QoSProfile(depth=5, reliability=reliability)
        self.outputs = {name: self.create_publisher(kind, name, self.sensor) for name, kind in STATES[options.state].items()}
        for name, (kind, take) in COMMANDS[options.command].items():
            self.create_subscription(kind, name, lambda m, take=take: self._take(take(self, m)), self.sensor)
        self.create_subscription(PoseStamped, "reference/pose", self._on_reference, 10)
        self.autopilot = AUTOPILOTS[options.state](self) if options.state in AUTOPILOTS else None
        self.stepped = self._seconds()
        self.begun = self.next = self.stepped
        self.create_timer(STEP, self._run)
        self.create_timer(1.0, self._report)

    def _seconds(self) -> float:
        return float(self.get_clock().now().nanoseconds) * 1e-9

    def _take(self, drive: tuple[float, float]) -> None:
        self.drive, self.driven_at = drive, self._seconds()

    def _on_reference(self, message: PoseStamped) -> None:
        self.reference = message.pose.position.x, message.pose.position.y

    def _run(self) -> None:
        now = self._seconds()
        if self.autopilot:
            left, right = self.autopilot(self.state)
            self._take((0.5 * (left + right), 0.5 * (right - left)))
        while self.stepped < now:
            self._step()
            self.stepped += STEP
        if now >= self.next and not self.autopilot:
            low, high = self.o.rate
            self.next = now + 1.0 / self.random.uniform(low, high)
            if self.random.random() >= self.o.loss:
                PUBLISH[self.o.state](self, self.get_clock().now().to_msg())

    def _step(self) -> None:
        x, y, psi, u, v, r = self.state
        fx, nz = self.wrench() if self._seconds() - self.driven_at < TIMEOUT else (0.0, 0.0)
        (m1, m2), (d1, d2, d3) = MASS, DRAG
        du = (m2 * v * r - d1 * u + fx) / m1
        dv = (-m1 * u * r - d2 * v) / m2
        dr = ((m1 - m2) * u * v - d3 * r + nz) / INERTIA
        u, v, r = u + STEP * du, v + STEP * dv, r + STEP * dr
        psi += STEP * r
        x += STEP * (u * math.cos(psi) - v * math.sin(psi))
        y += STEP * (u * math.sin(psi) + v * math.cos(psi))
        self.state = [x, y, psi, u, v, r]

    def wrench(self) -> tuple[float, float]:
        """Force and moment of the drives; with cmd_vel, those of loops for speed and turn rate."""
        a, b = self.drive
        if self.o.command in ("cmd_vel", "twist"):
            u, r = self.state[3], self.state[5]
            a, b = 70.0 * a + 1100.0 * (a - u), 400.0 * b + 2100.0 * (b - r)
        elif self.o.command in ("thrusters", "pwm"):
            a, b = a + b, LEVER * (b - a)
        elif self.o.command != "wrench":
            a, b = FORCE * a, MOMENT * b
        return max(-FORCE, min(FORCE, a)), max(-MOMENT, min(MOMENT, b))

    def world_velocity(self) -> tuple[float, float]:
        """Velocity along x and y of the frame of the pose."""
        _, _, psi, u, v, _ = self.state
        return u * math.cos(psi) - v * math.sin(psi), u * math.sin(psi) + v * math.cos(psi)

    def _report(self) -> None:
        if self.reference is None:
            return
        error = math.hypot(self.state[0] - self.reference[0], self.state[1] - self.reference[1])
        self.errors.append(error)
        rms = math.sqrt(sum(e * e for e in self.errors) / len(self.errors))
        x, y = self.state[:2]
        print(
            f"t {self.stepped - self.begun:.0f} at {x:.2f} {y:.2f}, {error:.3f} m from the reference, rms {rms:.4f}", flush=True
        )


def fill(boat: Boat, pose: Any, twist: Any) -> None:
    """Write the state into a pose and a twist, the latter along the axes of the hull or of the pose, or not at all."""
    x, y, psi, u, v, r = boat.state
    pose.position.x, pose.position.y = x, y
    pose.orientation.w, pose.orientation.z = math.cos(0.5 * psi), math.sin(0.5 * psi)
    velocity = boat.world_velocity() if boat.o.twist == "parent" else (u, v)
    if boat.o.twist != "none":
        twist.linear.x, twist.linear.y, twist.angular.z = *velocity, r


def publish_odometry(boat: Boat, stamp: Any) -> None:
    """nav_msgs/Odometry."""
    message = Odometry(child_frame_id="base_link")
    message.header.stamp, message.header.frame_id = stamp, boat.o.frame
    fill(boat, message.pose.pose, message.twist.twist)
    boat.outputs["odom"].publish(message)


def publish_pose_and_twist(boat: Boat, stamp: Any) -> None:
    """geometry_msgs/PoseStamped and TwistStamped."""
    pose, twist = PoseStamped(), TwistStamped()
    pose.header.stamp = twist.header.stamp = stamp
    pose.header.frame_id, twist.header.frame_id = boat.o.frame, "base_link"
    fill(boat, pose.pose, twist.twist)
    boat.outputs["twist"].publish(twist)
    boat.outputs["pose"].publish(pose)


def publish_satellite_fix(boat: Boat, stamp: Any) -> None:
    """sensor_msgs/NavSatFix, course and speed of the antenna, and Imu."""
    x, y, psi, _, _, r = boat.state
    fix, imu = NavSatFix(), Imu()
    fix.header.stamp = imu.header.stamp = stamp
    fix.header.frame_id, imu.header.frame_id, fix.status.status = "gps", "imu", 0
    east, north = x + ANTENNA * math.cos(psi), y + ANTENNA * math.sin(psi)
    fix.latitude, fix.longitude = place(east, north)
    imu.orientation.w, imu.orientation.z, imu.angular_velocity.z = math.cos(0.5 * psi), math.sin(0.5 * psi), r
    boat.outputs["imu"].publish(imu)
    east_speed, north_speed = boat.world_velocity()
    r_z = boat.state[5] * ANTENNA
    east_speed, north_speed = east_speed - r_z * math.sin(psi), north_speed + r_z * math.cos(psi)
    boat.outputs["course"].publish(Float64(data=math.atan2(east_speed, north_speed)))
    boat.outputs["speed"].publish(Float64(data=math.hypot(east_speed, north_speed)))
    boat.outputs["fix"].publish(fix)


def publish_otter(boat: Boat, stamp: Any) -> None:
    """A fix of unknown status, and an Imu whose orientation has roll, pitch and yaw in degrees, clockwise from north."""
    x, y, psi, _, _, r = boat.state
    fix, imu = NavSatFix(), Imu()
    fix.header.stamp = imu.header.stamp = stamp
    fix.latitude, fix.longitude = place(x + ANTENNA * math.cos(psi), y + ANTENNA * math.sin(psi))
    imu.orientation.z, imu.angular_velocity.z = math.degrees(0.5 * math.pi - psi), -math.degrees(r)
    boat.outputs["imu"].publish(imu)
    boat.outputs["fix"].publish(fix)


def place(east: float, north: float) -> tuple[float, float]:
    """Latitude and longitude near ORIGIN, by the radii of curvature of WGS84 there."""
    phi = math.radians(ORIGIN[0])
    a, e2 = 6378137.0, 0.00669437999014
    w = math.sqrt(1.0 - e2 * math.sin(phi) ** 2)
    meridian, normal = a * (1.0 - e2) / w**3, a / w
    return ORIGIN[0] + math.degrees(north / meridian), ORIGIN[1] + math.degrees(east / (normal * math.cos(phi)))


def thrust_of(pulse: int) -> float:
    """Thrust of a controller for a pulse width, N: linear outside a deadband."""
    way = abs(pulse - NEUTRAL)
    return math.copysign(THRUST * (way - DEADBAND) / (SPAN - DEADBAND), pulse - NEUTRAL) if way > DEADBAND else 0.0


def ardupilot(boat: Boat) -> Any:
    """An autopilot that speaks MAVLink, by what it does in a step: it takes commands, reports, and gives two thrusts."""
    from mavlink_autopilot import Autopilot  # needs pymavlink

    autopilot = Autopilot(*boat.o.address)

    def step(state: list[float]) -> Any:
        autopilot.receive()
        thrusts = autopilot.step(state[3], -state[5])
        autopilot.report(tuple(state))
        return thrusts

    return step


def px4(boat: Boat) -> Any:
    """The same of PX4 over DDS, in which a person selects Offboard as soon as it accepts that."""
    from px4_autopilot import OFFBOARD, Autopilot  # needs px4_msgs

    autopilot = Autopilot(boat)
    chosen = False

    def step(state: list[float]) -> Any:
        nonlocal chosen
        chosen = chosen or autopilot.mode == OFFBOARD or autopilot.select_offboard()
        autopilot.report(state)
        return autopilot.thrusts()

    return step


AUTOPILOTS = {"mavlink": ardupilot, "px4": px4}
STATES: dict[str, dict[str, Any]] = {
    "odometry": {"odom": Odometry},
    "pose_twist": {"pose": PoseStamped, "twist": TwistStamped},
    "mavlink": {},
    "px4": {},
    "navsat": {"fix": NavSatFix, "imu": Imu, "course": Float64, "speed": Float64},
    "otter": {"fix": NavSatFix, "imu": Imu},
}
PUBLISH = {
    "odometry": publish_odometry,
    "pose_twist": publish_pose_and_twist,
    "navsat": publish_satellite_fix,
    "otter": publish_otter,
}
COMMANDS: dict[str, dict[str, Any]] = {
    "wrench": {"cmd_wrench": (WrenchStamped, lambda _, m: (m.wrench.force.x, m.wrench.torque.z))},
    "normalised": {"normalised_wrench": (WrenchStamped, lambda _, m: (m.wrench.force.x, m.wrench.torque.z))},
    "otter": {"normalised_wrench": (WrenchStamped, lambda _, m: (m.wrench.force.x, -m.wrench.torque.z))},
    "cmd_vel": {"cmd_vel": (TwistStamped, lambda _, m: (m.twist.linear.x, m.twist.angular.z))},
    "twist": {"cmd_vel": (Twist, lambda _, m: (m.linear.x, m.angular.z))},
    "mavlink": {},
    "px4": {},
    "thrusters": {
        "thrusters/port/thrust": (Float64, lambda boat, m: (m.data, boat.drive[1])),
        "thrusters/starboard/thrust": (Float64, lambda boat, m: (boat.drive[0], m.data)),
    },
    "pwm": {
        "thrusters/port/pwm": (UInt16, lambda boat, m: (thrust_of(m.data), boat.drive[1])),
        "thrusters/starboard/pwm": (UInt16, lambda boat, m: (boat.drive[0], thrust_of(m.data))),
    },
    "helm": {
        "throttle": (Float64, lambda boat, m: (m.data, boat.drive[1])),
        "steering": (Float64, lambda boat, m: (boat.drive[0], m.data)),
    },
}


def main() -> int:
    """Run the boat until a signal ends it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--state", choices=STATES, default="odometry")
    parser.add_argument("--command", choices=COMMANDS, default="wrench")
    parser.add_argument("--frame", default="odom")
    parser.add_argument("--twist", choices=("child", "parent", "none"), default="child")
    parser.add_argument("--best-effort", action="store_true")
    parser.add_argument(
        "--rate", type=float, nargs=2, default=(50.0, 50.0), help="between which it changes from message to message"
    )
    parser.add_argument("--loss", type=float, default=0.0, help="share of the messages that are lost")
    parser.add_argument("--address", nargs="+", default=["udpout:127.0.0.1:14550"], help="of MAVLink's other ends")
    own, others = parser.parse_known_args()
    rclpy.init(args=[sys.argv[0], *others])
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Boat(own))
    return 0


if __name__ == "__main__":
    sys.exit(main())
