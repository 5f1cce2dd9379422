"""Mistakes of wiring, planted into a healthy connection, are named; the healthy one has none."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from connection_mistakes import MISTAKES, changed, clock_set, columns
from connections import SHIP, healthy, of
from durations import rest_long

from vessel_hsmc_ros.boats.parameters import interface
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Connection, Endpoint, Topic
from vessel_hsmc_ros.preflight.expected import connection_of, values_of
from vessel_hsmc_ros.preflight.rules import judge
from vessel_hsmc_ros.scenario.parameters import NODES, WATCHERS


@pytest.mark.parametrize("seed", range(8))
def test_a_healthy_connection_has_no_mistakes(seed: int) -> None:
    found = judge(healthy(seed, every=2 + seed % 3))
    assert of(found, WRONG) + of(found, TODO) == []
    assert {"velocities", "sign of force", "sign of moment", "stop", "time-out"} <= {f.about for f in found if f.level == OK}


@pytest.mark.parametrize("mistake", rest_long(MISTAKES, 10))
def test_each_planted_mistake_is_named(mistake: str) -> None:
    plant, expected = MISTAKES[mistake]
    wrong = of(judge(plant(healthy())), WRONG)
    assert any(expected in each for each in wrong), wrong


@pytest.mark.parametrize("column", ["frame", "child"])
@pytest.mark.parametrize(
    ("name", "is_down"),
    [("map_ned", True), ("MAP_NED", True), ("Odom_Ned", True), ("FRD", True), ("base_link_FRD", True), ("burned_map", False)],
)
def test_a_frame_of_x_north_or_z_down_is_named_however_it_is_written(column: str, name: str, is_down: bool) -> None:
    new: Any = {column: lambda c: np.array([name] * len(c["x"]), dtype=object)}
    wrong = of(judge(columns(**new)(healthy())), WRONG)
    (text,) = (each for each in wrong if repr(name) in each)
    assert ("a frame of x north or z down" in text) is is_down


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


@pytest.mark.parametrize("apart", [-1.7e9, -600.0, 600.0, 1.7e9])
def test_recordings_of_two_days_in_one_are_judged_by_the_motion_without_a_gap(apart: float) -> None:
    connection = healthy()

    def later(topic: Topic) -> Topic:
        begin = int(np.searchsorted(topic.received, 0.25 * connection.topics["/odom"].received[-1]))
        shift = apart * (np.arange(len(topic.received)) >= begin)
        stamps = {"stamp": topic.columns["stamp"] + shift} if "stamp" in topic.columns else {}
        return topic._replace(received=topic.received + shift, columns={**topic.columns, **stamps})

    found = judge(connection._replace(topics={name: later(topic) for name, topic in connection.topics.items()}))
    assert not [f for f in found if f.level == WRONG and f.about in {"velocities", "positions", "compass"}]
    assert [f.level for f in found if f.about.startswith("sign of")] == [OK, OK]


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


@pytest.mark.parametrize("moved", ["force", "moment", "u", "r", ""])
@pytest.mark.parametrize("form", ["wrench", "cmd_vel"])
def test_a_boat_that_lies_still_under_a_command_of_any_form_is_noticed_and_without_one_not(form: str, moved: str) -> None:
    names = ("u", "r") if form == "cmd_vel" else ("force", "moment")
    at: Any = {name: lambda c: np.full(len(c["x"]), 2.0) for name in ("x", "y", "psi")}
    at |= {name: lambda c: np.zeros(len(c["x"])) for name in "uvr"}
    still = columns(**at)(healthy()).topics
    command = still["/cmd_wrench"]
    numbers = {name: np.full(len(command.received), -3.0 * (name == moved)) for name in names}
    output = command._replace(name="/cmd_vel", columns={"stamp": command.columns["stamp"], **numbers})
    idle = command._replace(columns={**command.columns, "force": 0.0 * command.received, "moment": 0.0 * command.received})
    topics = (
        {"/cmd_wrench": idle, "/cmd_vel": output} if form == "cmd_vel" else {"/cmd_wrench": output._replace(name="/cmd_wrench")}
    )
    values = values_of(None, {"controller": SHIP} | ({"drive": {"form": "cmd_vel"}} if form == "cmd_vel" else {}))
    found = of(judge(connection_of(values, {}, topics={**still, **topics})), TODO)
    assert any("has not moved at all" in text for text in found) is (moved in names)


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


def test_the_pulses_of_each_thruster_need_a_reader() -> None:
    values = values_of(interface("pwm"), {})
    connection = connection_of(values, interface("pwm").nodes, topics=healthy().topics)
    wrong = of(judge(connection), WRONG)
    assert any(
        "no node publishes /odometry/filtered (nav_msgs/msg/Odometry): start with -r odom:=/odom" in text for text in wrong
    )
    for name in ("port", "starboard"):
        assert any(f"no node reads /thrusters/{name}/pwm (std_msgs/msg/UInt16)" in text for text in wrong)


def test_each_message_is_in_the_frame_and_as_old_as_the_node_that_takes_it_allows() -> None:
    read: Any = {
        "controller": {**SHIP, "frame_prefix": "a/", "input_timeout": 0.7},
        "drive": {"frame_prefix": "b/"},
        "navsat_odom": {"frame_prefix": "c/", "timeout": 0.2},
    }
    roles = {role.name: role for role in connection_of(values_of(None, read), {}).roles}
    assert (roles["odometry"].frames, roles["odometry"].child_frames) == (("a/odom", "a/map"), ("a/base_link",))
    assert roles["command"].frames == ("b/base_link",)
    assert [roles[name].timeout for name in ("odometry", "reference", "fix")] == [0.7, 0.7, 1.2]
    del read["drive"]
    (command,) = (role for role in connection_of(values_of(None, read), {}).roles if role.name == "command")
    assert command.frames == ("a/base_link",)


FORMS = [
    (node, name, choice)
    for node, name in (
        ("controller", "odometry.form"),
        ("navsat_odom", "heading"),
        ("navsat_odom", "velocity"),
        ("drive", "form"),
    )
    for choice in schema.entries((NODES | WATCHERS)[node])[name].choices
]


OF_CONTROLLER = ("odom", "pose", "twist", "reference", "cmd_wrench")


@pytest.mark.parametrize(("node", "name", "choice"), FORMS)
def test_the_topics_of_every_form_have_the_names_that_their_own_node_gives_them(node: str, name: str, choice: str) -> None:
    values = values_of(None, {"controller": SHIP, node: {name: choice}})
    plain = connection_of(values, {}).roles
    assert [role.topic for role in plain] == [f"/{role.own}" for role in plain]
    names = {each: {role.own: f"{each}/{role.own}" for role in plain} for each in ("controller", "navsat_odom", "drive")}
    owners = ["controller" if role.own in OF_CONTROLLER else node for role in plain]
    renamed = [role.topic for role in connection_of(values, names).roles]
    assert renamed == [f"/{owner}/{role.own}" for owner, role in zip(owners, plain, strict=True)]


def test_a_twist_of_zeros_is_no_mistake_with_an_observer() -> None:
    plant, _ = MISTAKES["twist not filled in"]
    assert of(judge(plant(healthy())._replace(uses_observer=True)), WRONG) == []
