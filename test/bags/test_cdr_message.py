"""Objects of messages: every kind of field in both byte orders, as rosbags reads it."""

from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from vessel_hsmc_ros.bags.topic_columns import MessageDecoder
from vessel_hsmc_ros.core.exceptions import BagError

KIND = "x/msg/All"
LINE = "=" * 80
DEFINITION = f"""uint8 FIRST=3
bool flag
int64 large
string text
uint8[] bytes
float64[3] three
float64[] numbers
string[2] pair
string[] names
Point[2] two
Point[] points
int16 last
{LINE}
MSG: x/msg/Point
float32 x
string name
float64 y
"""


def written(little_endian: bool, count: int) -> bytes:
    store: Any = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(DEFINITION, KIND))
    point = store.types["x/msg/Point"]
    message = store.types[KIND](
        *(True, -(1 << 40), "déjà", np.arange(count, dtype=np.uint8), np.arange(3.0), np.arange(float(count))),
        *(["a", ""], ["abc"] * count, [point(1.5, "p", 2.0)] * 2, [point(0.5, "qu", -2.0)] * count, -7),
    )
    return bytes(store.serialize_cdr(message, KIND, little_endian=little_endian))


def expected(data: bytes) -> Any:
    store: Any = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(DEFINITION, KIND))
    return store.deserialize_cdr(data, KIND)


@pytest.mark.parametrize("little_endian", [True, False])
@pytest.mark.parametrize("count", [0, 1, 5])
def test_every_kind_of_field_is_read_as_rosbags_reads_it(little_endian: bool, count: int) -> None:
    data = written(little_endian, count)
    found, right = MessageDecoder("/all", KIND, DEFINITION).deserialize(data), expected(data)
    for name in ("flag", "large", "text", "pair", "names", "last"):
        assert getattr(found, name) == getattr(right, name)
    for name in ("bytes", "three", "numbers"):
        np.testing.assert_array_equal(getattr(found, name), getattr(right, name))
    for name in ("two", "points"):
        pairs = list(zip(getattr(found, name), getattr(right, name), strict=True))
        assert all((a.x, a.name, a.y) == (b.x, b.name, b.y) for a, b in pairs)


def test_a_message_has_the_constants_and_the_name_of_its_type() -> None:
    found = MessageDecoder("/all", KIND, DEFINITION).deserialize(written(True, 1))
    assert (found.FIRST, found.__msgtype__) == (3, KIND)


@pytest.mark.parametrize("cut", range(1, 40, 3))
def test_a_message_that_is_cut_off_or_encoded_otherwise_is_refused(cut: int) -> None:
    data, decoder = written(True, 1), MessageDecoder("/all", KIND, DEFINITION)
    for wrong in (data[:-cut], b"\0\7" + data[2:]):
        with pytest.raises(BagError, match="is not a x/msg/All"):
            decoder.deserialize(wrong)
