"""Mutated serialised messages at the inputs of real nodes; `python benchmarks/raw_messages.py` sends more."""

from contextlib import suppress
from pathlib import Path

import pytest
from raw_messages import TARGETS, attack

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import BagError

MESSAGES = 60


@pytest.mark.parametrize("name", [name for name in TARGETS if name != "recorder"])
def test_a_node_survives_mutated_messages_and_answers_valid_ones_within_its_limits(name: str, tmp_path: Path) -> None:
    with attack(name, tmp_path) as attacked:
        attacked.send(MESSAGES)
        attacked.check()
        assert attacked.stop() == 0


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
