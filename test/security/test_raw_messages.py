"""Mutated serialised messages at the inputs of real nodes; `python benchmarks/raw_messages.py` sends more."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from durations import rest_long
from geometry_msgs.msg import WrenchStamped
from raw_messages import TARGETS, attack

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.nodes.base import decoded, serialized

MESSAGES = 60


@pytest.mark.parametrize("name", rest_long([name for name in TARGETS if name != "recorder"]))
def test_a_node_survives_mutated_messages_and_answers_valid_ones_within_its_limits(name: str, tmp_path: Path) -> None:
    with attack(name, tmp_path) as attacked:
        attacked.send(MESSAGES)
        attacked.check()
        assert attacked.stop() == 0


@pytest.mark.long
def test_a_bag_with_mutated_messages_is_complete_and_read_or_refused_in_one_line(tmp_path: Path) -> None:
    with attack("recorder", tmp_path) as attacked:
        attacked.send(19)  # it publishes once a second only
        attacked.check()
        assert attacked.stop() == 0
    bag = open_bag(tmp_path / "bag")
    assert bag.complete
    for use in (bag.load, lambda: list(bag.messages())):
        with suppress(BagError):
            use()


@pytest.mark.parametrize("damaged", [b"", b"\0\1\0\0", b"\0\1\0\0" + 50 * b"\xff", b"\0\0\0\0" + 50 * b"\xff"])
def test_a_damaged_message_is_refused_and_those_around_it_are_taken(damaged: bytes) -> None:
    outcome: list[Any] = []
    take = decoded(WrenchStamped, lambda message: outcome.append(message.wrench.force.x), lambda: outcome.append("refused"))
    whole = WrenchStamped()
    whole.wrench.force.x = 2.0
    for data in (serialized(whole), damaged, serialized(whole)):
        take(data)
    assert outcome == [2.0, "refused", 2.0]
