"""The types of the actions: those of nav2_msgs where it is installed, with the fields that its version has."""

import sys
from types import ModuleType
from typing import Any

import pytest
import vessel_hsmc_msgs.action

from vessel_hsmc_ros.guidance.tasks import Code
from vessel_hsmc_ros.nodes.actions import ACTIONS, Way, action_type, filled, missed

NAMES = sorted(action.kind for action in ACTIONS.values())


class Result:
    """The result of a version of nav2_msgs without words."""

    def __init__(self) -> None:
        self.error_code = 0

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]:
        return {"error_code": "uint16"}


@pytest.mark.parametrize("kind", NAMES)
def test_without_nav2_the_types_are_our_own_and_have_all_that_is_reported(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nav2_msgs.action", None)
    found = action_type(kind)
    assert found is getattr(vessel_hsmc_msgs.action, kind)
    assert {"error_code", "error_msg"} <= found.Result.get_fields_and_field_types().keys()
    feedback = found.Feedback.get_fields_and_field_types().keys()
    assert {"speed", "estimated_time_remaining"} <= feedback
    assert {"distance_remaining", "distance_to_goal"} & feedback


@pytest.mark.parametrize("kind", NAMES)
def test_the_codes_of_the_types_are_those_of_the_results(kind: str) -> None:
    names = {code.name: int(code) for code in Code if code is not Code.REACHED} | {"NONE": 0}
    assert {name: getattr(getattr(vessel_hsmc_msgs.action, kind).Result, name) for name in names} == names


def test_with_nav2_its_types_are_taken_where_it_has_them(monkeypatch: pytest.MonkeyPatch) -> None:
    nav2: Any = ModuleType("nav2_msgs.action")
    nav2.FollowPath = object()
    monkeypatch.setitem(sys.modules, "nav2_msgs", ModuleType("nav2_msgs"))
    monkeypatch.setitem(sys.modules, "nav2_msgs.action", nav2)
    assert action_type("FollowPath") is nav2.FollowPath
    assert action_type("FollowGPSWaypoints") is vessel_hsmc_msgs.action.FollowGPSWaypoints


def test_fields_that_a_version_does_not_have_are_left_out() -> None:
    result = filled(Result(), {"error_code": 10001, "error_msg": "path of 0 poses"})
    assert result.error_code == 10001
    assert not hasattr(result, "error_msg")


def test_waypoints_that_were_not_passed_are_named_once_each_also_of_loops() -> None:
    result = vessel_hsmc_msgs.action.FollowGPSWaypoints.Result()
    # Of four waypoints from the second on and all of them again: seven, of which five were passed.
    missed(result, Way([(0.0, 0.0)] * 7, "odom", first=1, total=4), 5, int(Code.CANCELLED))
    assert [(one.index, one.error_code) for one in result.missed_waypoints] == [(2, 10002), (3, 10002)]
