"""References that leave the fence are refused at the start, with the leg and the distance."""

from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.fence import Fence, FenceParameters, fence_of, leaving
from vessel_hsmc_ros.scenario.scenario import load_scenario


def box(size: float) -> list[float]:
    return [-size, -size, size, -size, size, size, -size, size, -size, -size]


def fence(size: float) -> Fence:
    found = fence_of(FenceParameters(inside=tuple(box(size)), outside=(4.0, -1.0, 5.0, -1.0, 5.0, 1.0, 4.0, -1.0)), "fence")
    assert found is not None
    return found


def test_the_first_leg_that_leaves_is_named_with_its_place_and_the_distance() -> None:
    way = np.array([0j, 0 + 5j, 13 + 5j, 13 + 8j, 0 + 8j])
    assert leaving(fence(10.0), way, [1, 2, 3, 4]) == "leg 2 leaves the fence between (0, 5) and (13, 5) m, by up to 3.0 m"
    assert leaving(fence(10.0), way[:2], [1]) == ""


def test_a_leg_through_an_area_to_stay_out_of_is_found_though_its_ends_are_allowed() -> None:
    assert leaving(fence(10.0), np.array([0j, 8 + 0j]), [1]).startswith("leg 1 leaves the fence between (0, 0) and (8, 0) m")


@pytest.mark.parametrize("group", ["controller.safety.fence", "reference_ship.fence"])
@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        ("waypoints", r"reference_ship\.path must stay within the fence \(got one whose leg 1 leaves the fence between \(19"),
        ("goal", r"reference_ship\.goal must stay within the fence \(got one whose leg 1 leaves .* by up to 44\.7 m\)"),
    ],
)
def test_a_scenario_whose_reference_leaves_the_fence_is_refused(group: str, scenario: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        load_scenario(scenario, {f"{group}.inside": box(20.0)})
    load_scenario(scenario, {f"{group}.inside": box(2000.0)})


def test_a_vessel_or_reference_that_begins_outside_is_refused() -> None:
    for changes, message in (
        ({"vessel_sim.initial_pose": [300.0, 0.0, 0.0]}, r"vessel_sim\.initial_pose must be inside .*\(got \(300, 0\) m\)"),
        (
            {"reference_ship.initial_pose": [300.0, 0.0, 0.0]},
            r"reference_ship\.initial_pose must be inside .*\(got \(300, 0\) m\)",
        ),
    ):
        given: dict[str, Any] = {"controller.safety.fence.inside": box(200.0), **changes}
        with pytest.raises(ParameterError, match=message):
            load_scenario("goal", given)


def test_a_polygon_that_is_none_is_refused_with_the_scenario() -> None:
    for group in ("controller.safety.fence", "reference_ship.fence"):
        with pytest.raises(ParameterError, match=rf"{group}\.outside, polygon 1, must have at least 3 corners \(got 2\)"):
            load_scenario("goal", {f"{group}.outside": [500.0, 500.0, 510.0, 500.0, 500.0, 500.0]})
