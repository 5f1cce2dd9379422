"""The connection with a boat as a bag has it: names, qualities of service, events."""

from pathlib import Path
from typing import Any

import pytest
from bag_making import CLOCK, clock, topic

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter, qos_entry
from vessel_hsmc_ros.preflight.expected import connection_in

RELIABLE, BEST_EFFORT = qos_entry(True, False), qos_entry(False, False)
LATCHED, WEAK = qos_entry(True, True), qos_entry(False, True)


@pytest.mark.parametrize(
    ("offered", "reliable", "latched"),
    [
        ([], True, False),
        ([RELIABLE], True, False),
        ([LATCHED, LATCHED], True, True),
        ([RELIABLE, BEST_EFFORT], False, False),
        ([BEST_EFFORT, RELIABLE], False, False),
        ([LATCHED, RELIABLE], True, False),
        ([LATCHED, WEAK], False, True),
    ],
)
def test_a_topic_is_as_reliable_and_as_latched_as_its_weakest_publisher(
    tmp_path: Path, offered: list[dict[str, Any]], reliable: bool, latched: bool
) -> None:
    writer, ticks = BagWriter(tmp_path / "bag"), topic("/clock", CLOCK)
    ticks.qos = offered
    writer.add_topic(ticks)
    writer.write(ticks, clock(0), 0, 0)
    writer.close()
    (publisher,) = connection_in(open_bag(tmp_path / "bag")).topics["/clock"].publishers
    assert (publisher.reliable, publisher.latched, publisher.kind) == (reliable, latched, CLOCK)
