"""How the parameters of an autopilot's failsafes are requested, and what their messages mean."""

import math
import struct

from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.boats.failsafes import (
    ARDUPILOT,
    BURST,
    FIRMWARE,
    INTEGERS,
    NAMES,
    PX4,
    RENEWED,
    TRIES,
    ParameterReader,
)

REAL = 9


@given(st.sets(st.sampled_from(NAMES[ARDUPILOT])), st.sampled_from(list(FIRMWARE)))
def test_all_that_an_autopilot_has_are_read_soon_and_each_again_later(has: set[str], autopilot: int) -> None:
    reader = ParameterReader()
    names = NAMES[FIRMWARE[autopilot]]
    reader.heard(autopilot)
    requests: list[list[str]] = [reader.due()]
    for name in (n for n in requests[-1] if n in has):
        reader.take(name, 1.0, REAL)
    limit = TRIES * (len(names) // BURST + 1)
    for _ in range(limit + len(names)):
        requests.append(reader.due())
        for name in (n for n in requests[-1] if n in has):
            reader.take(name, 1.0, REAL)
    assert set(reader.values) == has & set(names)
    assert max(map(len, requests)) <= BURST
    assert {len(each) for each in requests[limit:]} == {RENEWED}
    assert {name for each in requests[-(len(names) // RENEWED + 1) :] for name in each} == set(names)


def test_nothing_is_requested_from_an_autopilot_of_no_known_firmware_and_a_silent_one_is_forgotten() -> None:
    reader = ParameterReader()
    assert reader.due() == []
    reader.heard(8)
    assert reader.due() == []
    reader.heard(3)
    reader.take("FS_ACTION", 2.0, REAL)
    reader.forget()
    assert (reader.firmware, reader.values, reader.due()) == ("", {}, [])


@given(st.floats(allow_nan=True))
def test_other_parameters_and_numbers_that_are_not_finite_do_not_count(value: float) -> None:
    reader = ParameterReader()
    reader.heard(3)
    reader.take("CRUISE_SPEED", 2.0, REAL)
    reader.take("FS_ACTION", value, REAL)
    assert reader.values == ({"FS_ACTION": value} if math.isfinite(value) else {})


@given(st.sampled_from(list(INTEGERS)), st.integers(0, 100))
def test_whole_numbers_are_packed_by_px4_and_converted_by_ardupilot(kind: int, number: int) -> None:
    packed = struct.unpack("<f", struct.pack(INTEGERS[kind], number).ljust(4, b"\0"))[0]
    for autopilot, value, name in ((12, packed, "GF_ACTION"), (3, float(number), "FS_ACTION")):
        reader = ParameterReader()
        reader.heard(autopilot)
        reader.take(name, value, kind)
        assert reader.values == {name: number}
    assert PX4 in NAMES
