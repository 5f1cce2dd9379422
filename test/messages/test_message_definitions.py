import pytest

from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages.topics import SEPARATOR, definition


@pytest.mark.parametrize(
    ("kind", "used"),
    [
        ("rosgraph_msgs/msg/Clock", ["builtin_interfaces/Time"]),
        (
            "geometry_msgs/msg/PoseStamped",
            [
                "std_msgs/Header",
                "builtin_interfaces/Time",
                "geometry_msgs/Pose",
                "geometry_msgs/Point",
                "geometry_msgs/Quaternion",
            ],
        ),
        ("vessel_hsmc_msgs/msg/ControlState", ["std_msgs/Header", "builtin_interfaces/Time"]),
        (
            "diagnostic_msgs/msg/DiagnosticArray",
            ["std_msgs/Header", "builtin_interfaces/Time", "diagnostic_msgs/DiagnosticStatus", "diagnostic_msgs/KeyValue"],
        ),
    ],
)
def test_a_definition_has_each_used_type_once_and_depth_first(kind: str, used: list[str]) -> None:
    parts = definition(kind).split(SEPARATOR)
    assert [part.split("\n", 1)[0] for part in parts[1:]] == used


def test_a_type_that_is_not_installed_is_named() -> None:
    with pytest.raises(BagError, match="no_msgs/msg/Nothing is not installed"):
        definition("no_msgs/msg/Nothing")
