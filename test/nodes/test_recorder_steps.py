"""The recorder's choice of topics, what it writes of publishers and into the bag, and its end, step by step."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import WrenchStamped
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from recording import record, recorded_topics

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages import raw
from vessel_hsmc_ros.nodes import recorder
from vessel_hsmc_ros.nodes.base import OK, WARN, VesselNode
from vessel_hsmc_ros.nodes.recorder import TopicChoice

PRESENT = ["/odom", "/camera/left", "/camera/left/info", "/camera/_raw", "/_hidden", "/alpha/_b/c", "/sonar", "/sonar2"]


@pytest.mark.parametrize(
    ("choice", "chosen"),
    [
        ({"names": ["/odom", "/_hidden"]}, ["/odom", "/_hidden"]),
        ({"everything": True}, ["/odom", "/camera/left", "/camera/left/info", "/sonar", "/sonar2"]),
        ({"everything": True, "exclude": "/sonar"}, ["/odom", "/camera/left", "/camera/left/info", "/sonar2"]),
        (
            {"everything": True, "exclude": "/camera/.*", "names": ["/camera/left"]},
            ["/odom", "/camera/left", "/sonar", "/sonar2"],
        ),
        ({"regex": "/sonar"}, ["/sonar"]),
        ({"regex": "sonar"}, []),
        ({"regex": "/camera/.*", "exclude": ".*/info"}, ["/camera/left"]),
        ({"regex": "/cam.*|/odom", "exclude": "/camera"}, ["/odom", "/camera/left", "/camera/left/info"]),
        ({}, []),
    ],
)
def test_names_take_precedence_and_expressions_match_whole_names_that_are_not_hidden(
    choice: dict[str, Any], chosen: list[str]
) -> None:
    made = TopicChoice(**{"names": [], **choice})
    assert made.new(PRESENT) == chosen
    assert made.open_ended is bool({"everything", "regex"} & set(choice))
    assert made.missing == choice.get("names", [])
    for name in chosen:
        made.take(name)
        assert name not in made.new(PRESENT)
    assert made.new(PRESENT) == []
    assert made.missing == []


def offered(**values: Any) -> dict[str, Any]:
    (entry,) = recorder._offered([SimpleNamespace(qos_profile=QoSProfile(depth=3, **values))])
    return entry


def test_each_quality_of_a_publisher_is_written_under_its_own_name() -> None:
    reliable, best_effort = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
    latched, volatile = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
    for reliability, durability in ((reliable, volatile), (best_effort, latched), (reliable, latched), (best_effort, volatile)):
        entry = offered(reliability=reliability, durability=durability)
        assert entry["reliability"] == ("reliable" if reliability is reliable else "best_effort")
        assert entry["durability"] == ("transient_local" if durability is latched else "volatile")
        words = recorder._in_words(QoSProfile(depth=1, reliability=reliability, durability=durability))
        assert words == f"{entry['reliability']}, {entry['durability']}".replace("_", " ")


def test_times_and_liveliness_of_a_publisher_are_written_and_infinite_ones_are_not() -> None:
    plain = offered()
    times = {"deadline": 1_500_000_000, "lifespan": 90_000_000_007, "liveliness_lease_duration": 3_000_000_000}
    given = offered(
        **{name: Duration(nanoseconds=value) for name, value in times.items()}, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC
    )
    for name, value in times.items():
        assert (given[name]["sec"], given[name]["nsec"]) == divmod(value, 10**9), name
        assert plain[name] != given[name]
    assert (plain["liveliness"], given["liveliness"]) == ("automatic", "manual_by_topic")


def test_the_bag_has_the_notes_of_the_run_and_is_split_by_size_or_by_duration(bench: Any, tmp_path: Path) -> None:
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text("controller: {}\n")
    node = record(
        bench,
        tmp_path,
        lockstep=False,
        split_size=7_000_000,
        split_duration=11.0,
        law_source="/a/law.py",
        scenario="case",
        scenario_file=str(scenario),
    )
    assert (node._writer._splitting.size, node._writer._splitting.duration) == (7_000_000, 11.0)
    node._dropped = 3
    node.close()
    bag = open_bag(tmp_path / "bag")
    expected = {"mode": "real time", "scenario": "case", "law_source": "/a/law.py", "messages_dropped": "3"}
    assert {name: bag.recording[name] for name in expected} == expected


def test_metadata_that_is_written_on_the_way_has_the_number_of_lost_messages(bench: Any, tmp_path: Path) -> None:
    node = record(bench, tmp_path)
    node._dropped = 4
    node._update_metadata()
    assert open_bag(tmp_path / "bag").recording["messages_dropped"] == "4"
    node.close()


def test_each_lost_message_is_a_warning_and_what_is_awaited_is_named(bench: Any, tmp_path: Path) -> None:
    node = record(bench, tmp_path, topics=["odom", "reference", "goal_pose", "path"])
    level, text, values = node.status()
    assert (level, text) == (OK, "recording; waiting for /odom, /reference")
    assert values == {"messages": 0, "dropped": 0, "missing": "/odom, /reference"}
    for dropped in (1, 2):
        node._dropped = dropped
        level, text, values = node.status()
        assert (level, text, values["dropped"]) == (WARN, f"{dropped} messages were lost", dropped)
    node.close()


@pytest.mark.parametrize(("lockstep", "awaited"), [(True, "/clock, /odom"), (False, "/odom")])
def test_a_recorder_on_the_clock_of_the_machine_awaits_no_simulated_time(
    bench: Any, tmp_path: Path, lockstep: bool, awaited: str
) -> None:
    node = record(bench, tmp_path, topics=["/clock", "odom"], lockstep=lockstep)
    assert node.status()[1] == f"recording; waiting for {awaited}"
    node.close()


def test_a_recorder_of_a_run_subscribes_to_nothing_before_all_that_begins_it_is_there(bench: Any, tmp_path: Path) -> None:
    topics = ["odom", "reference", "controller/state", "cmd_wrench"]
    node = record(bench, tmp_path, topics=topics, lockstep=False, recorded=True)
    for topic in topics[:2] + topics[3:]:
        bench.publisher(WrenchStamped, topic)
    bench.until(lambda: all(node.count_publishers(f"/{topic}") for topic in topics[:2] + topics[3:]))
    node._discover()
    assert recorded_topics(node) == set()
    bench.publisher(WrenchStamped, topics[2])
    bench.until(lambda: len(recorded_topics(node)) == 4)
    node.close()


def test_after_the_signal_what_is_in_transit_is_recorded_then_the_final_status_and_what_follows_from_it(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = record(bench, tmp_path)
    order: list[str] = []
    arriving = iter([1, 0, 2, 0, 0, 3, 0, 0, 0, 0, 0, 0] + [0] * 20)

    def spin(self: Any, running: Any) -> None:
        order.append("spin")
        while running():
            node._writer.message_count += next(arriving)

    monkeypatch.setattr(VesselNode, "spin", spin)
    monkeypatch.setattr(node, "publish_diagnostics", lambda: order.append(f"status after {node._writer.message_count}"))
    looks = iter([True, False])
    node.spin(lambda: next(looks))
    assert order == ["spin", "spin", "status after 6", "spin"]
    node._writer.message_count = 0
    node.close()


def test_a_recorder_ends_after_a_while_although_messages_go_on_to_arrive(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    node, now = record(bench, tmp_path), [0.0]

    def spin(self: Any, running: Any) -> None:
        while running() and now[0] < 100.0:
            now[0] += 0.1
            node._writer.message_count += 1

    monkeypatch.setattr(recorder, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr(VesselNode, "spin", spin)
    node._drain()
    assert now[0] == pytest.approx(recorder.DRAIN_LIMIT, abs=0.15)
    node._writer.message_count = 0
    node.close()


def test_a_topic_of_two_types_is_left_out_and_the_others_are_recorded(bench: Any, tmp_path: Path) -> None:
    node = record(bench, tmp_path, topics=["thing"])
    infos = [
        SimpleNamespace(topic_type=kind, topic_type_hash="", qos_profile=QoSProfile(depth=1))
        for kind in ("geometry_msgs/msg/WrenchStamped", "geometry_msgs/msg/PoseStamped")
    ]
    node._subscribe("/thing", infos)
    node._subscribe("/other", infos[:1])
    node.close()
    assert set(open_bag(tmp_path / "bag").topics) == {"/other"}


def test_what_a_fleet_may_lack_and_what_it_waits_for_is_known_in_each_namespace(bench: Any, tmp_path: Path) -> None:
    topics = [f"{vessel}/{name}" for vessel in ("a", "b") for name in ("odom", "goal_pose", "cmd_wrench")]
    node = record(bench, tmp_path, topics=topics, lockstep=False, recorded=True)
    assert node.status()[2]["missing"] == "/a/odom, /a/cmd_wrench, /b/odom, /b/cmd_wrench"
    assert node._awaited == {"/a/odom", "/b/odom"}
    node.close()


@pytest.mark.parametrize("error", [ImportError("no module"), AttributeError("no such message"), BagError("no definition")])
def test_a_topic_whose_type_is_not_installed_is_left_out_and_the_others_are_recorded(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    """A package that is missing, and one of another version that has no such message."""
    node = record(bench, tmp_path, topics=["thing", "other"])

    def fail(_kind: str) -> Any:
        raise error

    kind = "geometry_msgs/msg/WrenchStamped"
    infos = [SimpleNamespace(topic_type=kind, topic_type_hash="", qos_profile=QoSProfile(depth=1))]
    owner, name = (recorder, "definition") if isinstance(error, BagError) else (raw, "message_class")
    with monkeypatch.context() as missing:
        missing.setattr(owner, name, fail)
        node._subscribe("/thing", infos)
    node._subscribe("/other", infos)
    node.close()
    assert set(open_bag(tmp_path / "bag").topics) == {"/other"}
