"""The nodes that take part in a loop: of a single vessel, and of a fleet, which has one recorder."""

import pytest

from vessel_hsmc_ros.core.node_list import ALLOCATION, CONTROLLER, PLANT, RECORDER, REFERENCE, taking_part


@pytest.mark.parametrize("by_thrusters", [False, True])
@pytest.mark.parametrize("vessels", [(), ("one",), ("one", "two", "three")])
def test_each_vessel_has_its_own_nodes_the_plant_last_and_the_recorder_is_first_and_one(
    by_thrusters: bool, vessels: tuple[str, ...]
) -> None:
    found = taking_part(by_thrusters, vessels)
    own = (*((ALLOCATION,) if by_thrusters else ()), CONTROLLER, REFERENCE, PLANT)
    prefixes = [f"{vessel}/" for vessel in vessels] or [""]
    assert sorted(found) == sorted([RECORDER, *(prefix + name for prefix in prefixes for name in own)])
    assert found[0] == RECORDER
    assert set(found[-len(prefixes) :]) == {prefix + PLANT for prefix in prefixes}
