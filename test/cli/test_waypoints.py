from pathlib import Path

import pytest

from vessel_hsmc_ros.cli.path import read_waypoints
from vessel_hsmc_ros.core.exceptions import ScenarioError


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "10,0\n10,5.5\n"),
        ("a.csv", "x,y\n# the harbour\n10, 0\n\n10, 5.5\n"),
        ("a.csv", "# the harbour\n\n# of the north\nx,y\n10,0\n10,5.5\n"),
        ("a.csv", "# the harbour\n10,0\n10,5.5\n"),
        ("a.csv", "\ufeffx,y,heading\r\n10,0,0\r\n10,5.5,0\r\n"),
        ("a.yaml", "- [10, 0]\n- [10, 5.5]\n"),
        ("a.yaml", "waypoints: [10, 0, 1e1, 5.5]\n"),
    ],
)
def test_waypoints_are_read_from_csv_and_yaml(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert read_waypoints(tmp_path / name) == [(10.0, 0.0, 0.0), (10.0, 5.5, 0.0)]


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.csv", "1,2\n3,abc\n", "a.csv, line 2: 3,abc is not allowed: it takes x,y or x,y,heading, finite numbers"),
        ("a.csv", "1,nan\n", "line 1: 1,nan is not allowed"),
        ("a.csv", "x,y\n1,2\nnan,3\n4,5\n", "line 3: nan,3 is not allowed"),
        ("a.csv", "1,2\nx,y\n4,5\n", "line 2: x,y is not allowed"),
        ("a.csv", "nan,3\n4,5\n", "line 1: nan,3 is not allowed"),
        ("a.csv", "Infinity,3\n4,5\n", "line 1: Infinity,3 is not allowed"),
        ("a.csv", "1,2,3,4\n", "line 1: 1,2,3,4 is not allowed"),
        ("a.csv", "x,y\n", "a.csv has no waypoint: it takes x,y in each row"),
        ("a.yaml", "waypoints: [1, 2, 3]\n", "waypoint 2: 3 is not allowed"),
        ("a.yaml", "[[1, 2], 3]\n", "waypoint 2: 3 is not allowed"),
        ("a.yaml", "speed: 1\n", "a.yaml has no list of waypoints"),
        ("a.yaml", "[1, 2\n", "a.yaml cannot be read"),
    ],
)
def test_a_file_without_usable_waypoints_is_refused_with_the_place(tmp_path: Path, name: str, text: str, reason: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as refused:
        read_waypoints(tmp_path / name)
    assert reason in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"path file .*/none.csv cannot be read"):
        read_waypoints(tmp_path / "none.csv")
