"""The satellite-odometry node: odometry in the plane of a datum from satellite fixes, a heading and perhaps a velocity."""

import math
from importlib import import_module
from typing import Any, NamedTuple

from geometry_msgs.msg import QuaternionStamped, TwistStamped
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus
from std_msgs.msg import Float64

from vessel_hsmc_ros.boats.epochs import Epochs
from vessel_hsmc_ros.boats.parameters import NavsatOdometryParameters
from vessel_hsmc_ros.core.kinematics import FARTHEST, Motion, Plane, exchanged, heading_from_quaternion, in_body_frame, wrap
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WARN, VesselNode
from vessel_hsmc_ros.nodes.odometry_output import OdometryOutput, datum_publisher

RATE = 10.0  # rate of fixes that the deadline of the odometry is offered for, Hz
EXPECTED = {"imu": "imu", "imu_euler": "imu", "quaternion": "heading", "quaternion_ned": "heading"}
"""The topic of each source of the heading, but for two antennas."""

NOT_MEASURED = -1.0
"""The first number of a covariance in an Imu message whose quantity is not measured."""

BASE_LINE = 0.1, 1e3  # least and largest distance of two antennas, m: the same fix on both topics has no heading


class Heading(NamedTuple):
    """A heading with its time, ns: rad from east, counter-clockwise, and the yaw rate, rad/s."""

    stamp: int
    psi: float
    r: float


class NavsatOdometryNode(VesselNode):
    """Publishes odometry for each satellite fix, in the plane of a datum: x to the east, y to the north.

    The position is that of the vessel's origin, not of the antenna. A fix without a heading of its time, or far from the datum,
    is not published, and reported. Without the parameter, the datum is the first fix that the next one agrees with. The services
    fromLL and toLL of robot_localization are offered where its package is installed.
    """

    NAME = "navsat_odom"
    REAL_TIME = "sensors work"
    INTERFACE = """
        subscribes to  fix, imu, heading, fix_2 (by its heading), fix_velocity, course, speed (by its velocity)
        publishes      odom, odom/datum
        services       fromLL, toLL (where robot_localization is installed)
    """
    PARAMETERS = NavsatOdometryParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._plane = Plane(*p.datum) if p.datum else None
        self._heading: Heading | None = None
        self._first: NavSatFix | None = None
        self._epochs: Epochs[NavSatFix] = Epochs(round(p.timeout * NANOSECONDS))
        self._velocity: tuple[int, float, float] | None = None
        self._course: tuple[int, float] | None = None
        self._fixes = 0
        self._odometry = OdometryOutput(self, RATE, p.frame)
        self._state_datum = datum_publisher(self, self._odometry.message.header.frame_id)
        if p.datum:
            self._state_datum(*p.datum)
        self._subscribe(p.heading, p.velocity)
        self._offer_conversions()

    def _subscribe(self, heading: str, velocity: str) -> None:
        self.listen(NavSatFix, "fix", self._on_fix, qos.NEWEST)
        if heading == "antennas":
            self.listen(NavSatFix, "fix_2", self._on_second_fix, qos.NEWEST)
        elif heading in ("quaternion", "quaternion_ned"):
            self.listen(QuaternionStamped, "heading", self._on_quaternion, qos.NEWEST)
        if heading in ("imu", "imu_euler"):
            self.listen(Imu, "imu", self._on_imu if heading == "imu" else self._on_angles, qos.NEWEST)
        if velocity == "twist":
            self.listen(TwistStamped, "fix_velocity", self._on_velocity, qos.NEWEST)
        elif velocity == "course":
            self.listen(Float64, "course", self._on_course, qos.NEWEST)
            self.listen(Float64, "speed", self._on_speed, qos.NEWEST)

    def describe(self) -> str:
        """The sources of heading and velocity."""
        p = self.parameters
        datum = f"{p.datum[0]:.7f}, {p.datum[1]:.7f}" if p.datum else "the first fix"
        return f"odometry from fixes, heading by {p.heading}, velocity by {p.velocity}, datum {datum}"

    # -- inputs -------------------------------------------------------------------------------------------------------

    def _on_imu(self, message: Imu) -> None:
        if message.orientation_covariance[0] == NOT_MEASURED:
            self.refuse("imu must have an orientation (got orientation_covariance[0] = -1, which says that it has none)")
            return
        known = message.angular_velocity_covariance[0] != NOT_MEASURED
        self._take_heading(message.header.stamp, message.orientation, message.angular_velocity.z if known else None)

    def _on_angles(self, message: Imu) -> None:
        """Take a yaw in degrees, clockwise from north, from the place of the quaternion's z, and its rate in degrees a second."""
        yaw, rate = math.radians(message.orientation.z), math.radians(message.angular_velocity.z)
        if not (math.isfinite(yaw) and math.isfinite(rate)):
            self.refuse(f"yaw and yaw rate must be finite (got {yaw} and {rate})")
            return
        psi = 0.5 * math.pi - yaw + self.parameters.heading_offset
        self._heading = Heading(conversions.nanoseconds(message.header.stamp), psi, -rate)

    def _on_quaternion(self, message: QuaternionStamped) -> None:
        self._take_heading(message.header.stamp, message.quaternion)

    def _take_heading(self, at: Any, q: Any, rate: float | None = None) -> None:
        """Take an orientation; without a yaw rate, that since the last one counts."""
        if q.x == q.y == q.z == q.w == 0.0 or not all(map(math.isfinite, (q.x, q.y, q.z, q.w, rate or 0.0))):
            self.refuse("orientation must be a quaternion of length 1 (got one that is not filled in, or not finite)")
            return
        yaw, stamp, p = heading_from_quaternion(q.x, q.y, q.z, q.w), conversions.nanoseconds(at), self.parameters
        psi = (0.5 * math.pi - yaw if p.heading == "quaternion_ned" else yaw) + p.heading_offset
        self._heading = Heading(stamp, psi, self._rate_since(stamp, psi) if rate is None else rate)

    def _rate_since(self, stamp: int, psi: float) -> float:
        """The yaw rate since the last heading, rad/s; zero where that is a second old."""
        last = self._heading
        if last is None or not 0 < stamp - last.stamp < NANOSECONDS:
            return 0.0
        return wrap(psi - last.psi) / seconds(stamp - last.stamp)

    def _on_second_fix(self, message: NavSatFix) -> None:
        if self._is_good(message, "fix_2") and (self._plane is None or self._is_near(self._plane, message, "fix_2")):
            self._pair(1, message)

    def _on_velocity(self, message: TwistStamped) -> None:
        velocity = message.twist.linear
        if math.isfinite(velocity.x) and math.isfinite(velocity.y):
            self._velocity = conversions.nanoseconds(message.header.stamp), velocity.x, velocity.y

    def _on_course(self, message: Float64) -> None:
        if abs(message.data) > 2.0 * math.pi + 0.1:  # some drivers round
            self.refuse(f"course must be in rad, clockwise from north, within 2·pi (got {message.data:g}): is it in degrees?")
            return
        self._course = self.now(), message.data

    def _on_speed(self, message: Float64) -> None:
        now, (at, course) = self.now(), self._course or (0, math.nan)
        # A course that is not published any more must not turn with the boat; then there is no velocity.
        if abs(now - at) <= self.parameters.timeout * NANOSECONDS and math.isfinite(message.data) and math.isfinite(course):
            self._velocity = now, message.data * math.sin(course), message.data * math.cos(course)

    # -- odometry -----------------------------------------------------------------------------------------------------

    def _on_fix(self, message: NavSatFix) -> None:
        self._fixes += 1
        if not self._is_good(message, "fix"):
            return
        plane = self._plane = self._plane or self._agreed(message)
        if plane is None or not self._is_near(plane, message, "fix"):
            return
        if self.parameters.heading == "antennas":
            self._pair(0, message)
            return
        stamp = conversions.nanoseconds(message.header.stamp)
        heading = self._at(stamp)
        if heading is None:
            topic = self.resolve_topic_name(EXPECTED[self.parameters.heading])
            self.refuse(f"fix without a heading of its time on {topic}, within {self.parameters.timeout:g} s, is not published")
            return
        self._publish(plane, message, stamp, heading)

    def _agreed(self, message: NavSatFix) -> Plane | None:
        """The plane of the fix before, if this one agrees with it: a receiver may begin with a fix of another place."""
        first, self._first = self._first, message
        if first is None:
            return None
        plane = Plane(first.latitude, first.longitude)
        if (distance := plane.distance(message.latitude, message.longitude)) > FARTHEST:
            self.refuse(f"two fixes that give the datum must be within 50 km of each other (got {distance / 1e3:.0f} km)")
            return None
        text = f"datum: the first fix, {first.latitude:.8f}, {first.longitude:.8f}; the parameter datum keeps it"
        self.get_logger().info(text)
        self._state_datum(first.latitude, first.longitude)
        return plane

    def _is_near(self, plane: Plane, message: NavSatFix, name: str) -> bool:
        """Whether a fix is as near to the datum as those of a boat can be."""
        distance = plane.distance(message.latitude, message.longitude)
        if distance <= FARTHEST:
            return True
        hint = "was the first fix wrong? A restart takes another one"
        if self.parameters.datum:
            hint = "is the datum of another place?"
            if exchanged(plane, message.latitude, message.longitude):
                hint = "are latitude and longitude of the datum exchanged?"
        datum, place = (f"{p.latitude:.5f}, {p.longitude:.5f}" for p in (plane, message))
        self.refuse(f"{name} must be within 50 km of the datum {datum} (got {distance / 1e3:.0f} km, at {place}): {hint}")
        return False

    def _is_good(self, message: NavSatFix, name: str) -> bool:
        """Whether a message has a fix; drivers that leave the status unknown have a position."""
        if message.status.status == NavSatStatus.STATUS_NO_FIX:
            self.refuse(f"{name} without a satellite fix (status {message.status.status}) is not published")
            return False
        if not (abs(message.latitude) < 90.0 and abs(message.longitude) <= 360.0 and (message.latitude or message.longitude)):
            self.refuse(f"{name} must be in degrees, not at a pole and not at 0, 0 (got {message.latitude}, {message.longitude})")
            return False
        return True

    def _at(self, stamp: int) -> Heading | None:
        """The heading at the time of a fix, ns, by the yaw rate; None if there is none of about that time."""
        last = self._heading
        if last is None or abs(stamp - last.stamp) > self.parameters.timeout * NANOSECONDS:
            return None
        return Heading(stamp, last.psi + last.r * seconds(stamp - last.stamp), last.r)

    def _pair(self, source: int, message: NavSatFix) -> None:
        """Take a fix of one of two antennas; one that completes an epoch gives odometry, whichever comes last."""
        stamp = conversions.nanoseconds(message.header.stamp)
        pair = self._epochs.take(source, stamp, message)
        if pair is not None and self._plane is not None:
            first, second = pair
            if (heading := self._between_antennas(self._plane, first, second)) is not None:
                self._publish(self._plane, first, heading.stamp, heading)
        elif self._epochs.is_single(stamp):
            within = 1e-9 * self._epochs.difference
            self.refuse(f"no odometry: no fix and fix_2 are of one time, within {within:.3g} s, half of their interval at most")

    def _between_antennas(self, plane: Plane, fix: NavSatFix, second: NavSatFix) -> Heading | None:
        """The heading by the line from one antenna to the other; None where they are no two antennas of a vessel."""
        stamp = conversions.nanoseconds(fix.header.stamp)
        first, other = (plane.place(m.latitude, m.longitude) for m in (fix, second))
        apart = math.hypot(other.x - first.x, other.y - first.y)
        if not BASE_LINE[0] <= apart <= BASE_LINE[1]:
            self.refuse(f"fix and fix_2 must be {BASE_LINE[0]:g} m to {BASE_LINE[1]:g} m apart (got {apart:.3g} m): one antenna?")
            return None
        psi = math.atan2(other.y - first.y, other.x - first.x) - first.convergence - self.parameters.heading_offset
        self._heading = Heading(stamp, psi, self._rate_since(stamp, psi))
        return self._heading

    def _publish(self, plane: Plane, fix: NavSatFix, stamp: int, heading: Heading) -> None:
        place, (ahead, port) = plane.place(fix.latitude, fix.longitude), self.parameters.antenna
        psi = wrap(heading.psi + place.convergence)
        c, s = math.cos(psi), math.sin(psi)
        x, y = place.x - c * ahead + s * port, place.y - s * ahead - c * port
        east, north = self._velocity_at(stamp)
        turn = place.convergence
        over_ground = Motion(
            x, y, psi, math.cos(turn) * east - math.sin(turn) * north, math.sin(turn) * east + math.cos(turn) * north, heading.r
        )
        motion = in_body_frame(over_ground)
        if self._velocity is not None:  # that of the antenna is that of the origin and of the turn
            motion = motion._replace(u=motion.u + heading.r * port, v=motion.v - heading.r * ahead)
        covariance = fix.position_covariance if fix.position_covariance_type else [0.0] * 9
        for k, number in ((0, 0), (7, 4)):
            self._odometry.message.pose.covariance[k] = float(covariance[number])
        self._odometry.publish(conversions.nanoseconds(fix.header.stamp), motion)

    def _velocity_at(self, stamp: int) -> tuple[float, float]:
        """Velocity to the east and to the north; zero if none is measured."""
        if self._velocity is not None:
            at, east, north = self._velocity
            if abs(stamp - at) <= self.parameters.timeout * NANOSECONDS:
                return east, north
            self._velocity = None
        if self.parameters.velocity != "none":
            self.refuse(f"no velocity within {self.parameters.timeout:g} s of the fix: the odometry has none")
        return 0.0, 0.0

    # -- services and diagnostics -------------------------------------------------------------------------------------

    def _offer_conversions(self) -> None:
        """Offer fromLL and toLL as robot_localization has them, where its package is installed."""
        try:
            services = import_module("robot_localization.srv")
        except ImportError:
            return
        self.create_service(services.FromLL, "fromLL", self._from_coordinates)
        self.create_service(services.ToLL, "toLL", self._to_coordinates)

    def _from_coordinates(self, request: Any, response: Any) -> Any:
        if self._plane is None:
            self.refuse("fromLL without a datum: there has been no fix")
        else:
            self._is_near(self._plane, request.ll_point, "the point of fromLL")
            place = self._plane.place(request.ll_point.latitude, request.ll_point.longitude)
            response.map_point.x, response.map_point.y = place.x, place.y
        return response

    def _to_coordinates(self, request: Any, response: Any) -> Any:
        if self._plane is None:
            self.refuse("toLL without a datum: there has been no fix")
        else:
            point = self._plane.coordinates(request.map_point.x, request.map_point.y)
            response.ll_point.latitude, response.ll_point.longitude = point
        return response

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Numbers of fixes and of published odometry, and what is missing."""
        values: dict[str, Any] = {"fixes": self._fixes, "published": self._odometry.published}
        if self._plane is not None:
            values |= {"datum_latitude": self._plane.latitude, "datum_longitude": self._plane.longitude}
        if self.problem.current:
            return *self.problem.current, values
        if not self._fixes:
            return WARN, f"waiting for a fix on {self.resolve_topic_name('fix')}", values
        if self._plane is None:
            return WARN, "waiting for a second fix: the datum is the first one that the next agrees with", values
        return OK, "running", values
