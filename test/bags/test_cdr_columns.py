"""Columns of messages: those that are refused by themselves are left out."""

from collections.abc import Callable

import numpy as np
import pytest
from bag_making import TYPES, message, serialized

from vessel_hsmc_ros.bags.topic_columns import MessageDecoder
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages.topics import definition

KIND = TYPES["odom"]
VALID = serialized(message(KIND, 0, np.random.default_rng(1)), KIND)
NAMES = ("pose.pose.position.x", "header.frame_id")


def replaced(at: int, byte: int) -> bytes:
    return VALID[:at] + bytes([byte]) + VALID[at + 1 :]


@pytest.mark.parametrize(
    "wrong",
    [VALID[:-4], replaced(1, 3), replaced(0, 1)],
    ids=["cut off", "another encapsulation", "no encapsulation"],
)
@pytest.mark.parametrize("place", [lambda wrong: [wrong], lambda wrong: [VALID, wrong], lambda wrong: [wrong, VALID]])
def test_what_is_refused_by_itself_is_left_out_of_columns(wrong: bytes, place: Callable[[bytes], list[bytes]]) -> None:
    decoder, messages = MessageDecoder("/odom", KIND, definition(KIND)), place(wrong)
    sizes = np.array([len(each) for each in messages])
    with pytest.raises(BagError):
        decoder.deserialize(wrong)
    columns, readable = decoder.columns(b"".join(messages), np.cumsum(sizes) - sizes, sizes, NAMES)
    assert readable.tolist() == [each is VALID for each in messages]
    assert {name: len(column) for name, column in columns.items()} == dict.fromkeys(NAMES, messages.count(VALID))


def test_no_field_of_whole_messages_needs_no_decoding(monkeypatch: pytest.MonkeyPatch) -> None:
    decoder = MessageDecoder("/odom", KIND, definition(KIND))
    monkeypatch.setattr(decoder, "deserialize", lambda _: pytest.fail("each message is decoded by itself"))
    columns, readable = decoder.columns(VALID + VALID, np.array([0, len(VALID)]), np.array([len(VALID)] * 2), [])
    assert columns == {}
    assert readable.tolist() == [True, True]
