"""Events of a recording, and the parameters at a time."""

from pathlib import Path

import numpy as np
import pytest
from bag_making import PERIOD, STORE, TYPES, message, serialized, topic, write_run
from rosbags.typesys import get_types_from_msg

from vessel_hsmc_ros.bags.reader import Event, open_bag
from vessel_hsmc_ros.bags.writer import SCENARIO, BagWriter
from vessel_hsmc_ros.messages.topics import EVENTS, RECORDED_TOPICS, definition
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario

KIND = RECORDED_TOPICS[EVENTS]
FIRST = 100 * PERIOD
MADE = [
    (FIRST + 50 * PERIOD, "controller", "parameter", "controller.guided.position_gain: 1.5 -> 0.5"),
    (FIRST + 150 * PERIOD, "vessel_sim", "parameter", "vessel_sim.disturbance.periodic.surge_force: 1100.0 -> 1e-05"),
    (FIRST + 20 * PERIOD, "vessel_sim", "pause", "paused"),
]

STORE.register({k: v for k, v in get_types_from_msg(definition(KIND), KIND).items() if k not in STORE.types})


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag of one vessel in a namespace whose odometry begins at FIRST; the first message arrives after the second."""
    writer = BagWriter(tmp_path / "bag")
    writer.attach(SCENARIO, dump_scenario(load_scenario("case2_tracking", {"controller.law": "guided"})))
    odometry, events = topic("/alpha/odom", TYPES["odom"]), topic("/alpha/events", KIND)
    rng = np.random.default_rng(0)
    for each in (odometry, events):
        writer.add_topic(each)
    for k in range(100, 300):
        received = k * PERIOD + (PERIOD + 1) * (k == 100)
        writer.write(odometry, serialized(message(odometry.kind, k * PERIOD, rng), odometry.kind), received, received)
    for stamp, node, kind, text in MADE:
        made = message(KIND, stamp, rng)
        made.node, made.kind, made.text = node, kind, text
        writer.write(events, serialized(made, KIND), stamp, stamp)
    writer.close()
    return tmp_path / "bag"


def test_events_have_the_time_since_the_first_odometry_and_its_order(bag: Path) -> None:
    events = open_bag(bag).events()
    assert events[0] == Event(0.2, "vessel_sim", "pause", "paused")
    assert [event.time for event in events] == pytest.approx([0.2, 0.5, 1.5], abs=1e-12)
    assert open_bag(bag).events("alpha") == events


def test_a_bag_without_the_topic_has_no_events(tmp_path: Path) -> None:
    write_run(tmp_path / "bag", 3)
    assert open_bag(tmp_path / "bag").events() == []


@pytest.mark.parametrize(("at", "gain", "force"), [(0.0, 1.5, 1100.0), (0.5, 0.5, 1100.0), (1.6, 0.5, 1e-5)])
def test_the_scenario_at_a_time_has_the_parameters_changed_until_then(bag: Path, at: float, gain: float, force: float) -> None:
    opened = open_bag(bag)
    scenario = opened.scenario(at=at)
    assert scenario.controller.guided.position_gain == gain
    assert scenario.vessel_sim.disturbance.periodic.surge_force == force
    assert opened.scenario().controller.guided.position_gain == 1.5
    assert opened.scenario({"controller.guided.position_gain": 0.7}, at=at).controller.guided.position_gain == 0.7
