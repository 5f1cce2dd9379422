"""The bag of a black box, whatever comes of its content: a node may be killed while it passes the content on."""

import io
import itertools
import pickle
from pathlib import Path

import pytest
from bag_making import CLOCK, PERIOD, clock

from vessel_hsmc_ros.bags.black_box import Head, write
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import BagError

COUNT = 5

TOPICS = ("/clock", "/other/clock")


def content(folder: Path) -> tuple[bytes, list[bytes]]:
    """Head and messages, of two topics in turns."""
    head = Head([str(folder)], {"reason": "fault"}, "/controller:\n  ros__parameters: {gain: 1.5}\n")
    return pickle.dumps(head), [pickle.dumps((k * PERIOD, TOPICS[k % 2], CLOCK, clock(k * PERIOD))) for k in range(COUNT)]


def written(whole: bytes) -> list[tuple[str, int, bytes]]:
    """Topics, times and data of the messages in the bag that is made of a content."""
    folder, refused = write(io.BytesIO(whole))
    assert refused == ""
    bag = open_bag(folder)
    assert bag.complete
    assert bag.recording["reason"] == "fault"
    assert bag.parameters == {"/controller": {"gain": 1.5}}
    return [(raw.topic, raw.log_time, raw.data) for raw in bag.raw_messages()]


def test_a_content_that_is_cut_off_anywhere_gives_a_bag_of_all_messages_before(tmp_path: Path) -> None:
    head, messages = content(tmp_path / "box")
    ends = [0, *itertools.accumulate(map(len, messages))]
    every = [(TOPICS[k % 2], k * PERIOD, clock(k * PERIOD)) for k in range(COUNT)]
    whole = b"".join(messages)
    for cut in (0, 13, 14, ends[1] - 1, ends[1], ends[2] + 3, ends[4] + 15, ends[-1] - 1, ends[-1]):
        assert written(head + whole[:cut]) == every[: sum(end <= cut for end in ends[1:])]


def test_a_content_that_is_cut_off_before_its_first_message_is_one_line(tmp_path: Path) -> None:
    head, _ = content(tmp_path / "box")
    for cut in (0, 1, len(head) - 1):
        with pytest.raises(BagError, match="the content of the black box is cut off before its first message"):
            write(io.BytesIO(head[:cut]))
    assert not [*tmp_path.iterdir()]
