"""Rules for a connection, data in, findings out: a topic is found, typed, compatible, regular, stamped and in its frame.

And what the sensors of `navsat_odom` send, and commands: a positive force drives ahead, a positive moment to port, both about as
far as the ship's inertia has it; stop and time-out have been tried. `connection` and `motion_rules` judge what messages contain.
"""

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from vessel_hsmc_ros.preflight.clocks import clock_step, judge_stamps
from vessel_hsmc_ros.preflight.connection import EULER, OK, TODO, WRONG, Connection, Endpoint, Finding, Role, Topic
from vessel_hsmc_ros.preflight.failsafe_rules import judge_failsafes
from vessel_hsmc_ros.preflight.motion_rules import judge_motion
from vessel_hsmc_ros.preflight.sign_rules import judge_signs

LEAST_RATE = 5.0  # rate of the state down to which the loop steers, Hz (benchmarks/boats.py)
STATE = ("x", "y", "psi", "u", "v", "r", "latitude", "longitude", "value")  # the columns that must be finite
UNCERTAIN = 10.0
"""Standard deviation of a position, m, from which on no receiver with a fix has it; on ships that are longer, their length."""


def judge(connection: Connection) -> list[Finding]:
    """All findings on a connection, in the order in which a person would look for mistakes."""
    found: list[Finding] = []
    for role in connection.roles:
        problems = [*judge_topic(connection, role)]
        topic = connection.topic(role)
        found += problems or [Finding(OK, role.name, summary(role, topic))]
    found += judge_clocks(connection)
    found += judge_sensors(connection)
    if not any(clock_step(connection.topic(role)) for role in connection.roles):  # cause and effect have no common time
        motion = [*judge_motion(connection)]
        doubted = next((each.about for each in motion if each.level == WRONG and each.about in ("heading", "yaw rate")), "")
        found += [*motion, *judge_signs(connection, doubted)]
    found += judge_exercises(connection)
    found += judge_failsafes(connection)
    levels = {"error": WRONG, "warning": TODO}
    return found + [Finding(levels[level], node, text) for node, (level, text) in connection.statuses.items()]


def summary(role: Role, topic: Topic) -> str:
    """A topic in one line: type, rate, frames, and its other end."""
    parts = [f"{topic.name}: {role.kinds[0] if not topic.publishers else topic.publishers[0].kind}"]
    if len(topic.received) > 1:
        intervals = np.diff(topic.received)
        parts.append(f"{1.0 / max(intervals.mean(), 1e-9):.3g} Hz, longest interval {intervals.max():.2g} s")
    if topic.publishers:
        parts.append("reliable" if topic.publishers[0].reliable else "best effort")
    frames = [", ".join(unique) for name in ("frame", "child") if (unique := _unique(topic, name))]
    if any(frames):
        parts.append(f"in {' -> '.join(filter(None, frames))}")
    other = topic.publishers if role.is_input else topic.readers
    if other:
        parts.append(f"{'from' if role.is_input else 'to'} {', '.join(dict.fromkeys(end.node for end in other))}")
    return ", ".join(parts)


def judge_topic(connection: Connection, role: Role) -> Iterator[Finding]:
    """Mistakes of one topic; those that follow from an earlier one are left out."""
    topic = connection.topic(role)
    wrong = [*judge_ends(connection, role, topic)]
    if role.is_input and not wrong and not len(topic.received):
        wrong.append(f"{role.topic} has a publisher, but no message came: is it waiting for something, such as a fix?")
    if not wrong and len(topic.received) > 2 and role.is_input:
        wrong += [*judge_rate(role, topic)] if clock_step(topic) is None else []
        wrong += [*judge_stamps(connection, role, topic)]
        wrong += [*judge_frames(role, topic)]
        wrong += [*judge_numbers(connection, topic, role.name != EULER)]
    elif not role.is_input:
        wrong += [*judge_frames(role, topic)]
    yield from (Finding(WRONG, role.name, text) for text in wrong)


def judge_ends(connection: Connection, role: Role, topic: Topic) -> Iterator[str]:
    """That a topic has both ends, of one type, with a compatible quality of service."""
    other = topic.publishers if role.is_input else topic.readers
    typed = [end for end in other if end.kind in role.kinds]
    if other and not typed:
        kind = other[0].kind
        yield f"{role.topic} is {kind} at {other[0].node}, and {' or '.join(role.kinds)} here: nothing passes"
    elif not other and (role.is_input or connection.is_live):
        yield absent(connection, role)
    for publisher, reader in product(topic.publishers, topic.readers):
        if publisher.kind == reader.kind and (policy := incompatible(publisher, reader)):
            yield (
                f"{role.topic}: the {policy} of {publisher.node} and of {reader.node} is not compatible: nothing passes;"
                f" change one of them, here by qos_overrides.{role.topic}"
            )
    publishers = [end.node for end in topic.publishers]
    if len(publishers) > 1:
        yield f"{role.topic} has {len(publishers)} publishers, {', '.join(publishers)}: end one of them"
    for end in topic.publishers if not role.is_input else ():
        if end.latched:
            text = "a driver that starts later carries out its last message, however old: publish it volatile"
            yield f"{role.topic} is latched (transient local) at {end.node}: {text}"


def incompatible(publisher: Endpoint, reader: Endpoint) -> str:
    """The policy in which a subscription requests more than a publisher offers; empty if there is none."""
    if reader.reliable and not publisher.reliable:
        return "reliability"
    return "durability" if reader.latched and not publisher.latched else ""


def absent(connection: Connection, role: Role) -> str:
    """That a topic has no other end, and those that could be meant."""
    verb = "publishes" if role.is_input else "reads"

    def open_end(topic: Topic) -> bool:
        ends, own = (topic.publishers, topic.readers) if role.is_input else (topic.readers, topic.publishers)
        return any(end.kind in role.kinds for end in ends) and not (own and not role.is_input)

    taken = {each.topic for each in connection.roles}
    like = [name for name, topic in connection.topics.items() if name not in taken and open_end(topic)]
    own = role.own or role.topic.rpartition("/")[2]
    others = f", or with {', '.join(like[1:4])}" if len(like) > 1 else ""
    hint = f"start with -r {own}:={like[0]}" if like else f"start what {verb} it, or compare its name with `ros2 topic list`"
    return f"no node {verb} {role.topic} ({' or '.join(role.kinds)}): {hint}{others}"


def judge_rate(role: Role, topic: Topic) -> Iterator[str]:
    """That messages come often enough, without long gaps."""
    intervals = np.diff(topic.received)
    rate = 1.0 / max(float(intervals.mean()), 1e-9)
    if rate < LEAST_RATE and role.name in ("odometry", "pose", "twist"):
        yield f"{topic.name} has {rate:.2g} Hz: it must have at least {LEAST_RATE:g} Hz"
    elif intervals.max() > role.timeout:
        yield (
            f"{topic.name} was silent for {intervals.max():.2g} s, above the time-out of {role.timeout:g} s: mend the gaps,"
            " or raise controller.input_timeout"
        )


def judge_frames(role: Role, topic: Topic) -> Iterator[str]:
    """That the frames are accepted ones, of ENU and FLU, and do not change."""
    pairs = (("frame", role.frames, "frames"), ("child", role.child_frames, "body_frames"))
    for column, accepted, parameter in pairs:
        names = _unique(topic, column)
        if foreign := [name for name in names if set(name.lower().split("_")) & {"ned", "frd"}]:
            yield f"{topic.name} is in {foreign[0]!r}, a frame of x north or z down: use its topic in ENU and FLU"
        elif len(names) > 1 and accepted:
            yield f"{topic.name} changes between the frames {', '.join(map(repr, names))}: two sources on one topic?"
        elif accepted and names and names[0] and names[0] not in accepted:
            add = f"add it to controller.odometry.{parameter}, or correct the driver"
            change = add if role.is_input else "the drives accept no command of another frame (frame_prefix)"
            yield f"{topic.name} is in {names[0]!r}, and {' or '.join(map(repr, accepted))} is accepted: {change}"


def judge_numbers(connection: Connection, topic: Topic, oriented: bool = True) -> Iterator[str]:
    """That numbers are finite, orientations, where it has them, of length 1 and upright, and covariances possible."""
    columns = topic.columns
    bad = [
        name for name, values in columns.items() if values.dtype.kind == "f" and name in STATE and not np.isfinite(values).all()
    ]
    if bad:
        yield f"{topic.name} has numbers that are not finite: {', '.join(bad)}"
    if "norm" in columns and oriented:
        norm = float(np.median(columns["norm"]))
        if norm < 1e-6:
            yield f"{topic.name} has orientations of zeros: its publisher does not fill them in"
        elif abs(norm - 1.0) > 0.01:
            yield f"{topic.name} has orientations of length {norm:.3g}: is an angle in place of a quaternion of length 1?"
        elif float(np.median(columns["up"])) < 0.0:
            yield f"{topic.name} is upside down (z down): its body frame is FRD, it must be FLU, x ahead and y to port"
    if "variance" in columns:
        variance = columns["variance"]
        if not (np.isfinite(variance).all() and (columns["least_variance"] >= 0.0).all()):
            yield f"{topic.name} has covariances that are negative or not finite: 0 stands for unknown"
        elif float(np.median(variance)) > connection.covariance_limit:
            limit = f"safety.freshness.covariance_limit = {connection.covariance_limit:g}"
            yield f"{topic.name} has a variance of {np.median(variance):.3g} m², above {limit}"
        elif (deviation := float(np.median(variance)) ** 0.5) > max(UNCERTAIN, connection.length):
            yield f"{topic.name} has a standard deviation of {deviation:.3g} m: has its filter a position?"


def judge_clocks(connection: Connection) -> Iterator[Finding]:
    """That nodes on simulated time have a /clock, and others have none of it."""
    clock = connection.topics.get("/clock")
    if connection.simulated and not (clock and clock.publishers):
        nodes = ", ".join(connection.simulated)
        yield Finding(WRONG, "clock", f"{nodes}: use_sim_time is set, and no node publishes /clock: time stands still; unset it")


def _unique(topic: Topic, column: str) -> list[str]:
    return list(dict.fromkeys(map(str, topic.columns.get(column, ()))))


NO_FIX = -1  # the status of sensor_msgs/NavSatStatus without a fix; -2 is unknown, which drivers have that do not fill it in


def judge_sensors(connection: Connection) -> Iterator[Finding]:
    """Mistakes of fixes and of what accompanies them."""
    for name, rule in (("fix", judge_fix), ("fix_2", judge_fix), ("imu", judge_imu), ("course", judge_course)):
        topic = connection.of(name)
        if topic is not None:
            yield from (Finding(WRONG, name, text) for text in rule(topic))
    fix, odometry = connection.of("fix"), connection.of("odometry", "pose")
    if fix is not None and odometry is not None and mirrored(fix, odometry):
        text = "the odometry is a mirror image of the fixes: x north and y east (NED) in place of x east and y north"
        yield Finding(WRONG, "odometry", f"{text}: let the driver publish ENU, such as MAVROS' local_position/odom")


def judge_fix(topic: Topic) -> Iterator[str]:
    """That a receiver has a fix, at latitude and longitude."""
    c = topic.columns
    if (c["status"] == NO_FIX).mean() > 0.5:
        yield f"{topic.name} has no satellite fix (status {int(c['status'][-1])}): antenna, cable, sky"
        return
    latitude, longitude = float(np.median(c["latitude"])), float(np.median(c["longitude"]))
    if abs(latitude) > 90.0 or abs(longitude) > 360.0:
        yield f"{topic.name} is at {latitude:.6g}, {longitude:.6g}: are latitude and longitude, in degrees, exchanged or scaled?"
    elif abs(latitude) < 1e-3 and abs(longitude) < 1e-3:
        yield f"{topic.name} is at 0, 0: its publisher fills in no position, or radians"


def judge_imu(topic: Topic) -> Iterator[str]:
    """That an IMU stands upright and measures in radians."""
    c = topic.columns
    if float(np.median(c["az"])) < -4.0:
        yield f"{topic.name} measures {np.median(c['az']):.3g} m/s² upwards at rest: it is FRD; it must be FLU, where that is 9.8"
    if float(np.max(np.abs(c["r"]))) > 2.0 * math.pi:
        yield f"{topic.name} has a yaw rate of {np.max(np.abs(c['r'])):.3g}: it must be in rad/s, not degrees"


def judge_course(topic: Topic) -> Iterator[str]:
    """That a course is in radians."""
    largest = float(np.max(np.abs(topic.columns["value"])))
    if largest > 2.0 * math.pi + 0.01:
        yield f"{topic.name} has values to {largest:.4g}: it must be in rad clockwise from north, not degrees"


def mirrored(fix: Topic, odometry: Topic) -> bool:
    """Whether positions turn the other way round than the fixes: the best map of displacements has a negative determinant."""
    if len(odometry.received) < 4 or len(fix.received) < 4:
        return False
    t = odometry.received
    phi = math.radians(float(np.median(fix.columns["latitude"])))
    east = np.radians(np.interp(t, fix.received, fix.columns["longitude"])) * math.cos(phi) * 6378137.0
    north = np.radians(np.interp(t, fix.received, fix.columns["latitude"])) * 6378137.0
    world, local = (
        np.array(p) - np.mean(p, axis=1, keepdims=True) for p in ((east, north), (odometry.columns["x"], odometry.columns["y"]))
    )
    values = np.linalg.svd(local @ world.T)[1]
    # Along a straight line a rotation and a mirror image fit alike.
    return bool(values[1] > 0.02 * values[0] and np.linalg.det(local @ world.T) < 0.0)


OUTPUTS = ("force", "moment", "u", "r", "value")  # the columns of commands
TIMEOUTS = ("OVERDUE", "STAMP_OLD")


def judge_exercises(connection: Connection) -> Iterator[Finding]:
    """Whether stop and time-out have been tried."""
    if not any(role.name == "command" for role in connection.roles):
        return
    if "stop" in connection.events:
        yield Finding(OK, "stop", "tried: a stop was called")
    else:
        yield Finding(TODO, "stop", "not tried: `vessel-hsmc call stop` while the boat moves, then `vessel-hsmc call rearm`")
    if silenced(connection):
        yield Finding(OK, "time-out", "tried: without commands the output of the drive went to zero")
    elif tried := [reason for reason in connection.reasons if reason in TIMEOUTS]:
        yield Finding(OK, "time-out", f"tried: the safe action began with {', '.join(tried)}")
    else:
        yield Finding(
            TODO, "time-out", "not tried: end the publisher of the state while the boat moves slowly; its thrust must end"
        )


def silenced(connection: Connection) -> bool:
    """Whether an output that was not zero went to zero although the last command was not."""
    command = next((connection.topic(role) for role in connection.roles if role.name == "command"), None)
    outputs = [connection.topic(role) for role in connection.roles if role.name in ("output", "throttle", "steering")]
    if command is None or not len(command.received) or "force" not in command.columns:
        return False
    if not (command.columns["force"][-1] or command.columns["moment"][-1]):
        return False
    values = [[output.columns[name] for name in OUTPUTS if name in output.columns] for output in outputs]
    last = [column[-1] for columns in values for column in columns if len(column)]
    return bool(last) and not any(last) and any(column.any() for columns in values for column in columns)
