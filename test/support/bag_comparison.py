"""A bag of the nodes compared message by message with the bag of the same scenario, run offline."""

from pathlib import Path

from vessel_hsmc_ros.bags.reader import Bag, Series, open_bag
from vessel_hsmc_ros.bags.run_to_bag import write_bag
from vessel_hsmc_ros.bags.topic_columns import MessageDecoder
from vessel_hsmc_ros.simulation.offline import ClosedLoop

WALL_TIME = {"/controller/state": "compute_time"}
"""Fields that are measured on the wall clock, by topic."""

NOT_OFFLINE = {"/diagnostics", "/rosout", "/parameter_events", "/events"}
"""Topics of the nodes themselves: an offline run has no nodes."""


def messages(bag: Bag, name: str) -> list[tuple[int, int, bytes]]:
    """Log time, publish time and serialised message of a topic; times of the wall clock are replaced by zeros."""
    found = [(raw.log_time, raw.publish_time, raw.data) for raw in bag.raw_messages(name)]
    if name not in WALL_TIME:
        return found
    layout = MessageDecoder(name, bag.topics[name].type, bag.topics[name].definition).layout(found[0][2])
    first, size = layout.fields[WALL_TIME[name]].offset, layout.fields[WALL_TIME[name]].size
    return [(log, sent, data[:first] + bytes(size) + data[first + size :]) for log, sent, data in found]


def description(series: Series) -> tuple[object, ...]:
    return series.type, series.definition, series.type_hash, series.qos, series.count


def assert_equal_to_the_offline_bag(recorded: Bag, folder: Path) -> None:
    """Run the scenario of a lockstep bag offline and compare the topics, their descriptions and their messages."""
    scenario = recorded.scenario()
    loop = ClosedLoop(scenario)
    loop.run()
    write_bag(folder, loop.published(), scenario)
    offline = open_bag(folder)
    assert set(offline.topics) == set(recorded.topics) - NOT_OFFLINE
    for name, series in offline.topics.items():
        assert description(series) == description(recorded.topics[name])
        assert messages(offline, name) == messages(recorded, name), name
