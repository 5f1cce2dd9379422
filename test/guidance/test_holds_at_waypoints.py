"""A vessel holds at waypoints for the time that is set, with the heading that is set, on its way and where it begins."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference
from vessel_hsmc_ros.guidance.path import PathReference
from vessel_hsmc_ros.scenario.scenario import load_scenario

PERIOD = 0.1
PLACES = [40.0, 0.0, 40.0, 40.0, 0.0, 40.0]


def reference_of(**values: Any) -> PathReference:
    changes = {f"reference_ship.{name.replace('__', '.')}": value for name, value in values.items()}
    given = {"reference_ship.mode": "path", "reference_ship.path.waypoints": PLACES, "reference_ship.path.time": 0.0, **changes}
    reference = make_reference(load_scenario("survey", given).reference_ship, PERIOD)
    assert isinstance(reference, PathReference)
    return reference


def states(reference: PathReference) -> np.ndarray:
    """The states (n, 6) to the end of the plan."""
    found = []
    for _ in range(int(reference.constants.table.times[-1] / PERIOD) + 2):
        found.append(reference.state.copy())
        reference.advance()
    return np.array(found)


def rest_at(place: tuple[float, float], found: np.ndarray) -> np.ndarray:
    """The rows in which the vessel is at rest at a place."""
    near = np.hypot(found[:, 0] - place[0], found[:, 1] - place[1]) < 0.2
    return np.flatnonzero(near & (np.abs(found[:, 3:]).max(axis=1) < 1e-9))


@pytest.mark.long
@settings(max_examples=5, deadline=None)
@given(hold=st.floats(1.0, 300.0), heading=st.floats(0.0, 6.28))
def test_the_vessel_rests_at_a_waypoint_for_its_hold_with_its_heading(hold: float, heading: float) -> None:
    plain, held = reference_of(path__corners=["through", "stop", "through"]), reference_of(path__holds=[0.0, hold, 0.0])
    longer = held.constants.table.times[-1] - plain.constants.table.times[-1]
    assert longer == pytest.approx(hold)  # a hold is a stop
    found = states(reference_of(path__holds=[0.0, hold, 0.0], path__headings=[-1.0, heading, -1.0]))
    turned = [row for row in rest_at((40.0, 40.0), found) if abs(wrap(found[row, 2] - heading)) < 1e-5]
    assert abs(PERIOD * len(turned) - hold) <= 3 * PERIOD


def test_the_last_waypoint_has_a_heading_without_a_stop_of_its_own() -> None:
    found = states(reference_of(path__headings=[-1.0, -1.0, 0.5]))
    assert found[-1] == pytest.approx([*found[-1, :2], found[-1, 2], 0.0, 0.0, 0.0], abs=1e-9)
    assert wrap(found[-1, 2] - 0.5) == pytest.approx(0.0, abs=1e-5)


def test_a_hold_where_the_vessel_lies_is_before_its_first_leg() -> None:
    at_start = [0.0, 0.0, *PLACES]
    plain, held = (
        reference_of(path__waypoints=at_start),
        reference_of(path__waypoints=at_start, path__holds=[25.0, 0.0, 0.0, 0.0]),
    )
    assert held.constants.table.times[-1] == pytest.approx(plain.constants.table.times[-1] + 25.0)
    found = states(held)
    assert PERIOD * len(rest_at((0.0, 0.0), found)) >= 25.0 - 2 * PERIOD


@pytest.mark.long
def test_the_holds_of_repeated_waypoints_add_up() -> None:
    twice = [*PLACES[:4], *PLACES[2:]]
    both = reference_of(path__waypoints=twice, path__holds=[0.0, 4.0, 6.0, 0.0])
    once = reference_of(path__holds=[0.0, 10.0, 0.0])
    assert both.constants.table.times[-1] == pytest.approx(once.constants.table.times[-1])


@pytest.mark.long
def test_the_motion_is_continuous_through_holds_and_turns_on_the_spot() -> None:
    found = states(reference_of(path__holds=[5.0], path__headings=[1.0]))
    assert np.abs(np.diff(found[:, :2], axis=0)).max() < 1.6 * PERIOD
    assert np.abs(np.diff(found[:, 3:], axis=0)).max() < 1.6 * PERIOD


def test_a_heading_where_the_vessel_does_not_stop_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"path.headings must be below 0 where the vessel does not stop, .* at waypoint 2"):
        reference_of(path__headings=[-1.0, 1.0, -1.0])
    one_for_all = reference_of(path__headings=[1.0])  # where it stops
    assert wrap(one_for_all.constants.table.rows[-1, 2] - 1.0) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("name", ["holds", "headings"])
def test_a_list_of_another_length_than_the_waypoints_is_refused(name: str) -> None:
    with pytest.raises(ParameterError, match=rf"path.{name} must have one value, or 3 for 3 waypoints \(got 2\)"):
        reference_of(**{f"path__{name}": [0.0, 0.0]})
    assert math.isfinite(build(ReferenceShipParameters, {}, "reference_ship").path.time)
