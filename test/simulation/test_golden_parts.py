"""Each part of a simulation alone, against its recorded motion."""

import json

import pytest
from durations import rest_long
from golden.parts import FILE, PARTS, deviation, load

RECORDED = load()


@pytest.mark.parametrize("name", rest_long(PARTS, 5))
def test_a_part_moves_as_recorded(name: str) -> None:
    run, tolerance = PARTS[name]
    ratio = deviation(RECORDED[name], run(), tolerance)
    assert ratio <= 1.0, f"{ratio:.3g} times the allowed deviation; `make golden` records an intended change"


def test_a_change_of_a_millionth_is_noticed_and_rounding_is_not() -> None:
    rows = RECORDED["plant_by_wrench"]
    for factor, noticed in ((1.0 + 1e-6, True), (1.0 + 1e-12, False)):
        changed = [[value * factor for value in row] for row in rows]
        assert (deviation(rows, changed, PARTS["plant_by_wrench"][1]) > 1.0) == noticed
    assert deviation(rows, rows[:-1], 1.0) == float("inf")


def test_the_recorded_parts_are_those_that_run() -> None:
    assert sorted(json.loads(FILE.read_text(encoding="utf-8"))) == sorted(PARTS)
