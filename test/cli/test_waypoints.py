from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.boats.missions.waypoints import read_waypoints
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
        ("a.yaml", "waypoints: [[10, 0], [1e1, 5.5]]\n"),
        ("a.csv", "y,x\n0,10\n5.5,10\n"),
        ("a.csv", "heading, z, y, x\n0, 7, 0, 10\n0, 7, 5.5, 10\n"),
        ("a.csv", "x,z,y\n10,1,0\n10,nan,5.5\n"),
    ],
)
def test_waypoints_are_read_from_csv_and_yaml(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert read_waypoints(tmp_path / name) == [(10.0, 0.0, 0.0), (10.0, 5.5, 0.0)]


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.csv", "1,2\n3,abc\n", "a.csv, line 2 must be x,y or x,y,heading, finite numbers (got 3,abc)"),
        ("a.csv", "1,nan\n", "line 1 must be x,y or x,y,heading, finite numbers (got 1,nan)"),
        ("a.csv", "x,y\n1,2\nnan,3\n4,5\n", "line 3 must be x,y or x,y,heading, finite numbers (got nan,3)"),
        ("a.csv", "1,2\nx,y\n4,5\n", "line 2 must be x,y or x,y,heading, finite numbers (got x,y)"),
        ("a.csv", "nan,3\n4,5\n", "line 1 must be x,y or x,y,heading, finite numbers (got nan,3)"),
        ("a.csv", "Infinity,3\n4,5\n", "line 1 must be x,y or x,y,heading, finite numbers (got Infinity,3)"),
        ("a.csv", "1,2,3,4\n", "line 1 must be x,y or x,y,heading, finite numbers (got 1,2,3,4)"),
        ("a.csv", "x,y\n", "a.csv has no waypoint: each row must be x,y"),
        ("a.yaml", "waypoints: [1, 2, 3]\n", "a.yaml has no list of waypoints: it must be [[x, y], [x, y], ...]"),
        ("a.yaml", "[0, 0, 1.57, 40, 0, 1.57]\n", "a.yaml has no list of waypoints: it must be [[x, y], [x, y], ...]"),
        ("a.yaml", "[[1_0, 2]]\n", "waypoint 1 must be x,y or x,y,heading, finite numbers (got 1_0,2)"),
        ("a.yaml", "[[1:30, 2]]\n", "waypoint 1 must be x,y or x,y,heading, finite numbers (got 1:30,2)"),
        ("a.yaml", "[[true, 2]]\n", "waypoint 1 must be x,y or x,y,heading, finite numbers (got True,2)"),
        ("a.csv", "1_0,2\n", "line 1 must be x,y or x,y,heading, finite numbers (got 1_0,2)"),
        ("a.csv", "1,2\n\u0661,\u0662\n", "line 2 must be x,y or x,y,heading, finite numbers (got \u0661,\u0662)"),
        ("a.csv", "\u0661,\u0662\n1,2\n", "line 1 must be x,y or x,y,heading, finite numbers (got \u0661,\u0662)"),
        (
            "a.csv",
            "lat,lon\n63.4401,10.3901\n63.4410,10.3920\n",
            "line 1: columns must be x and y, and perhaps z and heading, in metres",
        ),
        ("a.csv", "id,x,y\n1,0,0\n2,40,0\n", "(got id, x, y)"),
        ("a.csv", "north,east\n0,40\n", "(got north, east)"),
        ("a.csv", "x;y\n1;2\n", "(got x;y)"),
        ("a.csv", "x [m],y [m]\n1,2\n", "(got x [m], y [m])"),
        ("a.csv", "x,x\n1,2\n", "(got x, x)"),
        ("a.csv", "x,y,y\n1,2,3\n", "(got x, y, y)"),
        ("a.csv", "y,heading\n1,2\n", "(got y, heading)"),
        ("a.csv", "y,x\n1,2,3\n", "line 2 must be 2 numbers, y,x (got 1,2,3)"),
        ("a.yaml", "[[1, 2], 3]\n", "waypoint 2 must be x,y or x,y,heading, finite numbers (got 3)"),
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


@settings(max_examples=60, deadline=None)
@given(
    st.permutations(["x", "y", "z", "heading"]),
    st.integers(2, 4),
    st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 4), min_size=1, max_size=4),
)
def test_columns_count_by_their_names_in_any_order(tmp_path_factory, names, count, rows) -> None:
    names = names[:count]
    points = [dict(zip(("x", "y", "z", "heading"), row, strict=True)) for row in rows]
    text = "\n".join([",".join(names), *(",".join(repr(point[name]) for name in names) for point in points)])
    file = tmp_path_factory.mktemp("path") / "a.csv"
    file.write_text(text, encoding="utf-8")
    if {"x", "y"} <= set(names):
        assert read_waypoints(file) == [(p["x"], p["y"], p["heading"] if "heading" in names else 0.0) for p in points]
    else:
        with pytest.raises(ScenarioError, match=r"line 1: columns must be .* \(got .*\)"):
            read_waypoints(file)
