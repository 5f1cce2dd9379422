"""Mistakes of wiring, planted into a healthy connection, are named; the healthy one has none."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from connections import SHIP, healthy, of

from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.safety.connection import OK, TODO, WRONG, Connection, Endpoint, Topic
from vessel_hsmc_ros.safety.connection_rules import effect, judge
from vessel_hsmc_ros.scenario.connection import connection_of, values_of
from vessel_hsmc_ros.scenario.interfaces import interface


def changed(connection: Connection, topic: str, **changes: Any) -> Connection:
    return connection._replace(topics={**connection.topics, topic: connection.topics[topic]._replace(**changes)})


def columns(topic: str = "/odom", **new: Callable[[Any], Any]) -> Callable[[Connection], Connection]:
    """A change of columns: each new one by a function of all columns."""

    def plant(connection: Connection) -> Connection:
        old = connection.topics[topic].columns
        return changed(connection, topic, columns={**old, **{name: rule(old) for name, rule in new.items()}})

    return plant


def ends(topic: str, **new: Any) -> Callable[[Connection], Connection]:
    return lambda connection: changed(connection, topic, **new)


def times(rule: Callable[[Any], Any]) -> Callable[[Connection], Connection]:
    """A change of the times of receipt and of the stamps, as by a driver that is late."""

    def plant(connection: Connection) -> Connection:
        topic = connection.topics["/odom"]
        return changed(
            connection, "/odom", received=rule(topic.received), columns={**topic.columns, "stamp": rule(topic.received)}
        )

    return plant


def every(k: int) -> Callable[[Connection], Connection]:
    """Only every k-th odometry."""

    def plant(connection: Connection) -> Connection:
        topic = connection.topics["/odom"]
        thin = {name: values[::k] for name, values in topic.columns.items()}
        return changed(connection, "/odom", received=topic.received[::k], columns=thin)

    return plant


def world(c: Any) -> Any:
    return (c["u"] + 1j * c["v"]) * np.exp(1j * c["psi"])


def renamed(connection: Connection) -> Connection:
    topic = connection.topics["/odom"]
    without = {**connection.topics, "/odom": topic._replace(publishers=(), received=np.empty(0), columns={})}
    return connection._replace(topics={**without, "/boat/odometry": Topic("/boat/odometry", topic.publishers)})


def simulated(connection: Connection) -> Connection:
    return connection._replace(simulated=("controller",))


def text(value: str) -> Callable[[Any], Any]:
    return lambda c: np.array([value] * len(c["frame"]), dtype=object)


def alternating(c: Any) -> Any:
    return np.array(["odom" if k % 2 else "map" for k in range(len(c["frame"]))], dtype=object)


def gap(t: Any) -> Any:
    return np.where(t > t[len(t) // 2], t + 2.0, t)


def second_half(values: Any) -> Any:
    return np.arange(len(values)) > len(values) // 2


def clock_set(size: float) -> Callable[[Connection], Connection]:
    """The clock here is set by a time, s."""

    def plant(connection: Connection) -> Connection:
        received = connection.topics["/odom"].received
        return changed(connection, "/odom", received=received + size * second_half(received))

    return plant


def held_from(share: float) -> Callable[[Connection], Connection]:
    """The motion of a moment is repeated for the rest of the time."""

    def rule(name: str) -> Callable[[Any], Any]:
        return lambda c: c[name][np.minimum(np.arange(len(c[name])), int(share * len(c[name])))]

    changes: Any = {name: rule(name) for name in ("x", "y", "psi", "u", "v", "r")}
    return columns(**changes)


ODOM = types.ODOMETRY
MISTAKES: dict[str, tuple[Callable[[Connection], Connection], str]] = {
    "another name": (renamed, "-r odom:=/boat/odometry"),
    "another type": (ends("/odom", publishers=(Endpoint("driver", types.POSE),)), "geometry_msgs/msg/PoseStamped at driver"),
    "nothing is sent": (ends("/odom", received=np.empty(0), columns={}), "no message came"),
    "reliability": (
        ends("/odom", publishers=(Endpoint("driver", ODOM, False),), readers=(Endpoint("controller", ODOM, True),)),
        "the reliability of driver and of controller is not compatible",
    ),
    "durability": (
        ends("/cmd_wrench", readers=(Endpoint("driver", types.WRENCH, True, True),)),
        "the durability of controller and of driver",
    ),
    "two sources": (ends("/odom", publishers=(Endpoint("ekf", ODOM), Endpoint("driver", ODOM))), "2 publishers, ekf, driver"),
    "a joystick": (
        ends("/cmd_wrench", publishers=(Endpoint("controller", types.WRENCH), Endpoint("joy", types.WRENCH))),
        "2 publishers, controller, joy",
    ),
    "no driver": (ends("/cmd_wrench", readers=()), "no node reads /cmd_wrench"),
    "driver of Twist": (ends("/cmd_wrench", readers=(Endpoint("driver", types.TWIST),)), "geometry_msgs/msg/Twist at driver"),
    "slow": (every(10), "Hz: it takes 5 Hz"),
    "gaps": (times(gap), "silent for 2"),
    "no stamps": (columns(stamp=lambda c: 0.0 * c["stamp"]), "no stamps (0)"),
    "old stamps": (columns(stamp=lambda c: c["stamp"] - 3.0), "s old, above the time-out"),
    "stamps a little old": (columns(stamp=lambda c: c["stamp"] - 0.6), "s old, above the time-out"),
    "clock ahead": (columns(stamp=lambda c: c["stamp"] + 3.0), "ahead of the clock here"),
    "clock a little ahead": (columns(stamp=lambda c: c["stamp"] + 0.15), "ahead of the clock here"),
    "stamps go back": (columns(stamp=lambda c: c["stamp"] - 0.1 * (np.arange(len(c["x"])) % 2)), "stamps that go back"),
    "some stamps go back": (
        columns(stamp=lambda c: c["stamp"] - 0.1 * (np.arange(len(c["x"])) % 40 == 7)),
        "stamps that go back",
    ),
    "stamps repeat": (columns(stamp=lambda c: np.repeat(c["stamp"][::2], 2)[: len(c["x"])]), "repeats its stamps"),
    "frame": (columns(frame=text("world")), "'world', and 'odom' or 'map' is accepted"),
    "child frame": (columns(child=text("imu_link")), "odometry.body_frames"),
    "NED by name": (columns(frame=text("map_ned")), "a frame of x north or z down"),
    "changing frame": (columns(frame=alternating), "changes between the frames"),
    "no orientation": (columns(norm=lambda c: 0.0 * c["norm"]), "orientations of zeros"),
    "angle as quaternion": (columns(norm=lambda c: 57.0 * c["norm"]), "is an angle in place of a quaternion"),
    "half a quaternion": (columns(norm=lambda c: 0.6 * c["norm"]), "is an angle in place of a quaternion"),
    "FRD body": (columns(up=lambda c: -c["up"]), "upside down"),
    "negative covariance": (columns(least_variance=lambda c: c["variance"] - 1.0), "covariances that are negative"),
    "a covariance that is not finite": (
        columns(variance=lambda c: np.where(np.arange(len(c["x"])) == 7, np.nan, c["variance"])),
        "covariances that are negative or not finite",
    ),
    "not finite": (columns(x=lambda c: c["x"] * np.nan), "not finite: x"),
    "degrees for positions": (
        columns(x=lambda c: 59.9 + c["x"] / 111e3, y=lambda c: 10.7 + c["y"] / 56e3),
        "latitude and longitude",
    ),
    "twist in the world": (columns(u=lambda c: world(c).real, v=lambda c: world(c).imag), "twist_frame: parent takes that"),
    "twist not filled in": (
        columns(u=lambda c: 0 * c["u"], v=lambda c: 0 * c["v"], r=lambda c: 0 * c["r"]),
        "is the twist not filled in?",
    ),
    "knots": (columns(u=lambda c: c["u"] / 0.51444, v=lambda c: c["v"] / 0.51444), "in knots?"),
    "km/h": (columns(u=lambda c: 3.6 * c["u"], v=lambda c: 3.6 * c["v"]), "in km/h?"),
    "degrees per second": (columns(r=lambda c: np.degrees(c["r"])), "in degrees per second?"),
    "yaw rate of FRD": (columns(r=lambda c: -c["r"]), "is the yaw rate positive to starboard (FRD)?"),
    "surge astern": (columns(u=lambda c: -c["u"]), "is u positive astern?"),
    "compass heading": (
        columns(psi=lambda c: 0.5 * math.pi - c["psi"], r=lambda c: -c["r"]),
        "course and heading turn in opposite directions",
    ),
    "NED positions": (columns(x=lambda c: c["y"], y=lambda c: c["x"]), "or are positions x north and y east?"),
    "heading from north": (columns(psi=lambda c: c["psi"] - 0.5 * math.pi), "does the heading count from north?"),
    "all NED": (
        columns(
            x=lambda c: c["y"],
            y=lambda c: c["x"],
            psi=lambda c: 0.5 * math.pi - c["psi"],
            v=lambda c: -c["v"],
            r=lambda c: -c["r"],
        ),
        "positive yaw moment drives to starboard",
    ),
    "drives reversed": (columns("/cmd_wrench", force=lambda c: -c["force"]), "positive surge force drives astern"),
    "steering reversed": (columns("/cmd_wrench", moment=lambda c: -c["moment"]), "positive yaw moment drives to starboard"),
    "local time": (columns(stamp=lambda c: c["stamp"] + 7200.0), "in local time?"),
    "local time of half hours": (columns(stamp=lambda c: c["stamp"] - 19800.0), "in local time?"),
    "the smallest zone and half a minute": (columns(stamp=lambda c: c["stamp"] - 1770.0), "in local time?"),
    "the largest zone and half a minute": (columns(stamp=lambda c: c["stamp"] + 50_430.0), "in local time?"),
    "GPS time": (columns(stamp=lambda c: c["stamp"] + 18.0), "GPS time, which is 18 s ahead of UTC"),
    "stamps since boot": (columns(stamp=lambda c: c["stamp"] - 1.7e9), "counted from a start, or of a simulation"),
    "stamps step ahead": (columns(stamp=lambda c: c["stamp"] + 5.0 * second_half(c["stamp"])), "of /odom have stepped by 5 s"),
    "stamps step back": (columns(stamp=lambda c: c["stamp"] - 0.4 * second_half(c["stamp"])), "of /odom have stepped by -0.4"),
    "clock set ahead": (clock_set(5.0), "the clock here has stepped by 5 s"),
    "clock set back": (clock_set(-5.0), "the clock here has stepped by -5 s"),
    "no position in the filter": (columns(variance=lambda c: c["variance"] + 1e6), "a standard deviation of 1e+03 m"),
    "latched command": (
        ends("/cmd_wrench", publishers=(Endpoint("test", types.WRENCH, True, True),)),
        "carries out its last message, however old",
    ),
    "command of another frame": (
        columns("/cmd_wrench", frame=lambda c: np.array(["map"] * len(c["force"]), dtype=object)),
        "is in 'map', and 'base_link' is accepted",
    ),
    "command in kN": (columns("/cmd_wrench", force=lambda c: 1e-3 * c["force"]), "1e+03 times the effect of its number"),
    "moment of another ship": (columns("/cmd_wrench", moment=lambda c: 30.0 * c["moment"]), "times the effect of its number"),
    "repeated motion": (held_from(0.5), "does the driver repeat its last message?"),
    "corrected positions": (
        columns(x=lambda c: c["x"] + 3.0 * (np.arange(len(c["x"])) // 100 % 2)),
        "they jump, 11 times, by 3",
    ),
    "positions in mm": (columns(x=lambda c: 1e3 * c["x"], y=lambda c: 1e3 * c["y"]), "are the positions in mm?"),
    "feet per second": (columns(u=lambda c: c["u"] / 0.3048, v=lambda c: c["v"] / 0.3048), "in feet per second?"),
    "simulated time": (simulated, "no node publishes /clock"),
    "simulated time of a node that has ended": (
        lambda connection: simulated(connection)._replace(topics={**connection.topics, "/clock": Topic("/clock")}),
        "no node publishes /clock",
    ),
}


@pytest.mark.parametrize("seed", range(8))
def test_a_healthy_connection_has_no_mistakes(seed: int) -> None:
    found = judge(healthy(seed, every=2 + seed % 3))
    assert of(found, WRONG) + of(found, TODO) == []
    assert {"velocities", "sign of force", "sign of moment", "stop", "time-out"} <= {f.about for f in found if f.level == OK}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_each_planted_mistake_is_named(mistake: str) -> None:
    plant, expected = MISTAKES[mistake]
    wrong = of(judge(plant(healthy())), WRONG)
    assert any(expected in each for each in wrong), wrong


def test_velocities_in_the_frame_of_the_pose_are_right_where_they_are_declared_so_and_wrong_otherwise() -> None:
    parent, child = MISTAKES["twist in the world"][0](healthy())._replace(twist_frame="parent"), healthy()
    assert of(judge(parent), WRONG) == []
    (wrong,) = of(judge(child._replace(twist_frame="parent")), WRONG)
    assert "are they along the hull already?" in wrong


@pytest.mark.parametrize("every", [1, 3])
def test_velocities_of_a_topic_of_its_own_are_taken_at_the_times_of_the_poses(every: int) -> None:
    odometry, reference, command = (healthy().topics[name] for name in ("/odom", "/reference", "/cmd_wrench"))
    later = odometry.received[10:]
    pose = {name: values for name, values in odometry.columns.items() if name not in ("child", "u", "v", "r")}
    twist = {name: odometry.columns[name][10:][::every] for name in ("stamp", "frame", "u", "v", "r")}
    topics = {
        "/pose": Topic("/pose", (Endpoint("driver", types.POSE),), (), odometry.received, pose),
        "/twist": Topic("/twist", (Endpoint("driver", types.TWIST_STAMPED),), (), later[::every], twist),
        "/reference": reference,
        "/cmd_wrench": command,
    }
    values = values_of(None, {"controller": {**SHIP, "odometry.form": "pose_twist"}})
    found = judge(connection_of(values, {}, topics=topics, events=("stop",), reasons=("OVERDUE",)))
    assert of(found, WRONG) + of(found, TODO) == []
    spoilt = topics["/twist"]._replace(columns={**twist, "u": -twist["u"]})
    found = judge(connection_of(values, {}, topics={**topics, "/twist": spoilt}))
    assert any("is u positive astern?" in text for text in of(found, WRONG))


def test_velocities_that_the_observer_does_not_need_may_be_left_out_but_not_be_wrong() -> None:
    empty = MISTAKES["twist not filled in"][0](healthy())._replace(uses_observer=True)
    assert of(judge(empty), WRONG) == []
    wrong = MISTAKES["surge astern"][0](healthy())._replace(uses_observer=True)
    assert any("is u positive astern?" in text for text in of(judge(wrong), WRONG))


@pytest.mark.parametrize(("offset", "side"), [(0.35, "port"), (-0.35, "starboard")])
def test_a_heading_that_is_off_a_little_is_named_with_its_side_and_what_corrects_it(offset: float, side: str) -> None:
    (text,) = (each for each in of(judge(columns(psi=lambda c: c["psi"] + offset)(healthy())), TODO) if "of the way" in each)
    assert f"deg to {side} of the way of the positions" in text
    given = float(text.split("larger by ")[1].split()[0])
    assert given == pytest.approx(-offset, abs=0.06)


def test_a_boat_that_lies_still_before_its_first_command_repeats_nothing() -> None:
    connection = healthy()
    before = 5.0
    for name in ("/odom", "/cmd_wrench"):
        topic = connection.topics[name]
        count = round(before / float(np.median(np.diff(topic.received))))
        early = {"stamp", "received"}
        still: dict[str, Any] = {k: np.concatenate((np.repeat(v[:1], count), v)) for k, v in topic.columns.items()}
        times: dict[str, Any] = {"stamp": topic.columns["stamp"], "received": topic.received}
        longer = {k: np.concatenate((times[k][0] - before + before / count * np.arange(count), times[k])) for k in early}
        still |= {
            k: np.concatenate((np.zeros(count), v)) for k, v in topic.columns.items() if k in ("force", "moment", "u", "v", "r")
        }
        still["stamp"] = longer["stamp"]
        connection = changed(connection, name, received=longer["received"], columns=still)
    found = judge(connection)
    assert of(found, WRONG) + of(found, TODO) == []


def test_a_repeated_motion_without_sway_and_without_a_command_is_found_too() -> None:
    def without_commands(c: Any, name: str) -> Any:
        return np.where(np.arange(len(c[name])) < len(c[name]) // 2 - 5, c[name], 0.0)

    changes: Any = {name: lambda c, name=name: without_commands(c, name) for name in ("force", "moment")}
    repeated = columns("/cmd_wrench", **changes)(MISTAKES["repeated motion"][0](columns(v=lambda c: 0.0 * c["v"])(healthy())))
    assert any("does the driver repeat its last message?" in text for text in of(judge(repeated), WRONG))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("degrees", "cause"), [(90.0, "does the heading count from north?"), (180.0, "is it going astern")])
def test_a_heading_that_is_off_is_named_with_what_corrects_it(side: float, degrees: float, cause: str) -> None:
    """Velocities along the hull that points elsewhere: those of the world are as they were."""
    offset = math.radians(side * degrees)

    def hull(c: Any) -> Any:
        return (c["u"] + 1j * c["v"]) * np.exp(1j * offset)

    plant = columns(psi=lambda c: c["psi"] - offset, u=lambda c: hull(c).real, v=lambda c: hull(c).imag)
    (wrong,) = (each for each in of(judge(plant(healthy())), WRONG) if "of its heading" in each)
    assert cause in wrong
    given = float(wrong.split("heading_offset = ")[1].split()[0])
    assert math.remainder(given - offset, 2.0 * math.pi) == pytest.approx(0.0, abs=0.35)


def test_a_clock_that_steps_accuses_neither_velocities_nor_drives() -> None:
    for plant in (clock_set(5.0), clock_set(-5.0), MISTAKES["stamps step ahead"][0]):
        assert len(of(judge(plant(healthy())), WRONG)) == 1


@pytest.mark.parametrize(
    ("plant", "expected"),
    [
        (columns(psi=lambda c: c["psi"] + 0.35), "a compass from magnetic north or turned"),
        (columns(v=lambda c: 0.0 * c["v"]), "v is 0 in all messages"),
    ],
)
def test_what_may_be_a_mistake_is_left_to_do(plant: Callable[[Connection], Connection], expected: str) -> None:
    found = judge(plant(healthy()))
    assert of(found, WRONG) == []
    assert any(expected in each for each in of(found, TODO))


@pytest.mark.parametrize("late", [0.1, 0.4])
def test_a_state_that_comes_late_leaves_the_signs_as_they_are(late: float) -> None:
    found = judge(columns(stamp=lambda c: c["stamp"] - late)(healthy()))
    assert of(found, WRONG) + of(found, TODO) == []


def test_stamps_that_are_as_old_as_gps_time_is_ahead_are_not_in_gps_time() -> None:
    (wrong,) = of(judge(columns(stamp=lambda c: c["stamp"] - 18.0)(healthy())), WRONG)
    assert "s old" in wrong
    assert "GPS time" not in wrong


@pytest.mark.parametrize("count", range(16))
def test_a_connection_of_few_messages_is_judged_too(count: int) -> None:
    connection = healthy()
    short = {
        name: topic._replace(received=topic.received[:count], columns={k: v[:count] for k, v in topic.columns.items()})
        for name, topic in connection.topics.items()
    }
    found = judge(connection._replace(topics=short))
    assert bool(of(found, WRONG)) is (count == 0)


@pytest.mark.parametrize("begin", [0.3, 0.9])
def test_messages_that_come_late_for_a_while_are_no_step_of_a_clock(begin: float) -> None:
    """A computer without time for the node for 2 s, and then all at once."""
    connection = healthy()
    received = connection.topics["/odom"].received
    stopped = received[int(begin * len(received))]
    late = np.where((received > stopped) & (received < stopped + 2.0), stopped + 2.0, received)
    wrong = of(judge(changed(connection, "/odom", received=late)), WRONG)
    assert len(wrong) == 1
    assert "was silent for 2 s" in wrong[0]


@pytest.mark.parametrize("offset", [0.05, -0.4])
def test_a_clock_within_its_tolerance_is_no_mistake(offset: float) -> None:
    wrong = of(judge(columns(stamp=lambda c: c["stamp"] + offset)(healthy())), WRONG)
    assert not [each for each in wrong if "stamps" in each]


def test_what_a_boat_at_rest_does_not_show_is_left_to_do() -> None:
    still: Any = dict.fromkeys(("x", "y", "psi", "u", "v", "r"), lambda c: 0.0 * c["x"])
    rest = columns("/odom", **still)(healthy())
    found = judge(rest._replace(events=(), reasons=()))
    assert of(found, WRONG) == []
    assert {f.about for f in found if f.level == TODO} == {"velocities", "sign of force", "sign of moment", "stop", "time-out"}


@pytest.mark.parametrize(("sign", "level"), [(1.0, OK), (-1.0, WRONG)])
def test_signs_of_commanded_velocities_are_judged_as_those_of_a_wrench(sign: float, level: str) -> None:
    connection, name = healthy(), "/cmd_vel"
    c = connection.topics["/cmd_wrench"].columns
    columns = {"stamp": c["stamp"], "u": sign * c["force"] / 70.0, "r": sign * c["moment"] / 400.0}
    topic = connection.topics["/cmd_wrench"]._replace(name=name, columns=columns)
    values = values_of(None, {"controller": SHIP, "drive": {"form": "cmd_vel"}})
    found = judge(connection_of(values, {}, topics={**connection.topics, name: topic}))
    assert {f.about for f in found if f.level == level} >= {"sign of speed", "sign of rate"}


@pytest.mark.parametrize(
    ("last", "output", "level"),
    [
        ((90.0, 0.0), (0.0, 0.0), OK),
        ((0.0, 60.0), (0.0, 0.0), OK),
        ((0.0, 0.0), (0.0, 0.0), TODO),
        ((90.0, 5.0), (0.4, 0.0), TODO),
        ((90.0, 5.0), (0.0, 0.1), TODO),
    ],
)
def test_an_output_that_goes_to_zero_without_commands_shows_the_time_out(
    last: tuple[float, float], output: tuple[float, float], level: str
) -> None:
    command = healthy().topics["/cmd_wrench"]
    force, moment = (np.append(command.columns[name][:-1], value) for name, value in zip(("force", "moment"), last, strict=True))
    ended = {"u": np.append(force[:-1], output[0]), "r": np.append(moment[:-1], output[1]), "stamp": command.columns["stamp"]}
    topics = {
        "/cmd_wrench": command._replace(columns={**command.columns, "force": force, "moment": moment}),
        "/cmd_vel": command._replace(name="/cmd_vel", columns=ended),
    }
    values = values_of(None, {"controller": SHIP, "drive": {"form": "cmd_vel"}})
    found = judge(connection_of(values, {}, topics={**healthy().topics, **topics}))
    assert [f.level for f in found if f.about == "time-out"] == [level]


@pytest.mark.parametrize(("reason", "level"), [("OVERDUE", OK), ("STAMP_OLD", OK), ("JUMP", TODO)])
def test_each_safe_action_for_want_of_a_state_shows_the_time_out(reason: str, level: str) -> None:
    found = judge(healthy()._replace(reasons=(reason,)))
    assert [f.level for f in found if f.about == "time-out"] == [level]


@pytest.mark.parametrize(("wrong", "name"), [(0, "force"), (1, "moment")])
def test_the_size_of_each_effect_is_that_of_its_own_inertia(wrong: int, name: str) -> None:
    inertias = [550.0, 700.0]
    inertias[wrong] *= 20.0
    (text,) = of(judge(healthy()._replace(inertias=(inertias[0], inertias[1]))), WRONG)
    assert f"{name} has" in text
    assert ("surge_inertia", "yaw_inertia")[wrong] in text


@pytest.mark.parametrize("late", [0, 1, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_effect_of_a_command_is_found_that_acts_late(late: int, sign: int) -> None:
    command, rate = np.random.default_rng(5).uniform(-1.0, 1.0, 60), np.zeros(60)
    for k in range(59):
        rate[k + 1] = 0.9 * rate[k] + sign * 0.2 * command[max(k - late, 0)]
    found, slope = effect(command, rate)
    assert found == sign
    assert slope == pytest.approx(0.2 * sign, rel=0.05)


def test_the_pulses_of_each_thruster_need_a_reader() -> None:
    values = values_of(interface("pwm"), {})
    connection = connection_of(values, interface("pwm").nodes, topics=healthy().topics)
    wrong = of(judge(connection), WRONG)
    assert any(
        "no node publishes /odometry/filtered (nav_msgs/msg/Odometry): start with -r odom:=/odom" in text for text in wrong
    )
    for name in ("port", "starboard"):
        assert any(f"no node reads /thrusters/{name}/pwm (std_msgs/msg/UInt16)" in text for text in wrong)


def test_a_twist_of_zeros_is_no_mistake_with_an_observer() -> None:
    plant, _ = MISTAKES["twist not filled in"]
    assert of(judge(plant(healthy())._replace(uses_observer=True)), WRONG) == []
