"""What verbs print: numbers, units, names and lines of unlike values."""

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from records import make_run

from vessel_hsmc_ros.boats.missions.waypoints import read_waypoints
from vessel_hsmc_ros.cli import boat, comparing, console
from vessel_hsmc_ros.cli.console import progress_bar
from vessel_hsmc_ros.cli.gains import _margins
from vessel_hsmc_ros.cli.options import compare_with_row, print_json
from vessel_hsmc_ros.cli.sailing import SWITCHES, TRIGGERS
from vessel_hsmc_ros.cli.watch import _error, quantities
from vessel_hsmc_ros.control.loop.linearised_law import Margins
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.nodes.observation import Snapshot
from vessel_hsmc_ros.scenario.own_ship import OVERRIDES
from vessel_hsmc_ros.studies.identification.excitation import Step, space, table
from vessel_hsmc_ros.studies.paper.cases import CLAIMS, REPAIRED, of_law
from vessel_hsmc_ros.studies.paper.reproduction import load
from vessel_hsmc_ros.studies.verification import Verification, verdict


def test_the_manoeuvres_are_listed_with_their_own_times_inputs_and_speeds() -> None:
    time = np.arange(0.0, 60.0, 0.5)
    later = time >= 40.0
    state = np.column_stack(
        [
            np.where(later, -30.0, 10.0),
            np.linspace(-5.0, 2.0, len(time)),
            0.0 * time,
            np.where(later, -3.0, 0.6),
            np.where(later, 4.0, 0.8),
            np.where(later, -0.2, 0.1),
        ]
    )
    run = make_run(time, state)
    steps = [Step("first", 1.0, 0.3, 10.0), Step("first", 0.5, -0.3, 30.0), Step("second", -0.4, 0.8, 20.0)]
    assert table(steps, run) == [
        ["first", "0 to 40 s", "50 to 100 %", "±30 %", "1.00 m/s", "5.7°/s"],
        ["second", "40 to 60 s", "-40 %", "80 %", "5.00 m/s", "11.5°/s"],
    ]
    assert space(run) == "they take 1.0 min and, with the present data, 40 m by 7 m of water"


def test_watch_shows_force_moment_and_heading_of_ship_and_reference() -> None:
    ship, desired = Motion(1.0, 2.0, -3.0, 4.0, -5.0, -0.1), Motion(6.0, 7.0, 3.0, 8.0, 9.0, 0.2)
    found = quantities(Snapshot(1.5, ship, desired, (-5e4, -1.5e6), (2e5, 3e6), {}, {}, []))
    assert found["ship"] == "x 1.00 m, y 2.00 m, heading -171.9 deg, 4.00 m/s surge, -5.00 m/s sway, -5.73 deg/s"
    assert found["reference"] == "x 6.00 m, y 7.00 m, heading 171.9 deg, 8.00 m/s surge, 9.00 m/s sway, 11.46 deg/s"
    assert found["surge force"].replace("−", "-") == "-50 kN, 25% of 200 kN"
    assert found["yaw moment"].replace("−", "-") == "-1.5 MN·m, 50% of 3 MN·m"
    assert _error(ship, desired).endswith("heading 16.23 deg")  # the shorter way round


def test_the_rate_of_a_campaign_that_goes_on_is_that_of_this_call(monkeypatch: pytest.MonkeyPatch) -> None:
    now, updates = [100.0], []
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    show = comparing.with_rate(lambda done, note: updates.append((done, note)))
    for at, done in ((101.0, 50), (111.0, 70), (151.0, 100)):
        now[0] = at
        show(done, 400)
    assert updates == [(50, "0 runs/s, unknown time left"), (70, "2 runs/s, 0:02:45 left"), (100, "1 runs/s, 0:05:00 left")]


def test_progress_without_a_terminal_is_in_per_cent(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(console, "LINE_PERIODS", (-1.0, 1e6))
    with progress_bar("going", 400.0, "runs") as update:
        update(30.0)
        update(100.0, note="a note")
    assert capsys.readouterr().err.splitlines() == ["going, 400 runs", "going: 25 %, a note"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.yml", "[[1, 2], [3, 4, 0.5]]"),
        ("a.csv", "1,2\n3,4,0.5\n"),
        ("a.csv", "1,2\n\n# the end\n3,4,0.5"),
    ],
)
def test_waypoints_are_read_to_the_last(tmp_path: Any, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    assert read_waypoints(tmp_path / name) == [(1.0, 2.0, 0.0), (3.0, 4.0, 0.5)]


def test_a_wrong_waypoint_is_named_by_the_line_of_the_file(tmp_path: Any) -> None:
    (tmp_path / "a.csv").write_text("# comment\nx,y\n1,2\n\n3,none\n")
    with pytest.raises(ScenarioError, match=r"line 5 must be .*\(got 3,none\)"):
        read_waypoints(tmp_path / "a.csv")


def test_every_action_has_its_own_nodes_and_flag() -> None:
    both, controller = ("vessel_sim", "reference_ship"), ("controller",)
    assert {
        "pause": (both, "pause", True),
        "resume": (both, "pause", False),
        "hold": (("reference_ship",), "hold", True),
        "release": (("reference_ship",), "hold", False),
        "enable": (controller, "enable", True),
        "disable": (controller, "enable", False),
    } == SWITCHES
    assert {"reset": (*both, *controller), "stop": controller, "rearm": controller} == TRIGGERS


def test_each_margin_is_shown_and_the_one_that_a_loop_lacks_is_none() -> None:
    loops = {
        "both": Margins(True, 6.5, 40.4, 1.5, 0.25),
        "no gain": Margins(True, math.inf, 50.4, 2.5, 0.35),
        "no phase": Margins(True, 7.5, math.inf, 3.5, 0.45),
        "unstable": Margins(False, 8.5, 60.0, 4.5, 0.55),
    }
    found: Any = SimpleNamespace(loops=loops)
    assert _margins(found) == [
        ["both", "6.5 dB", "40°", "1.5 s", "0.25 rad/s"],
        ["no gain", "none", "50°", "2.5 s", "0.35 rad/s"],
        ["no phase", "7.5 dB", "none", "3.5 s", "0.45 rad/s"],
        ["unstable", *["unstable"] * 4],
    ]


def test_a_verification_names_the_first_difference_and_the_largest() -> None:
    recorded = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]])
    computed = recorded + np.array([[0.0, 0.0], [0.0, -0.5], [0.25, 0.0], [-0.125, 1.5]])
    assert verdict(Verification(np.array([0.0, 0.5, 1.0, 1.5]), recorded, computed, 9)) == [
        "4 commands over 1.5 s: max |delta tau| = 0.25 N, 1.5 N·m",
        "3 commands differ, the first at t = 0.5 s: surge force 3.0 N recorded and 3.0 N now, yaw moment 4.0 N·m recorded and"
        " 3.5 N·m now",
        "9 odometry messages follow the last one whose command and reference are in the bag",
    ]


def test_metrics_of_several_runs_have_a_line_for_each_that_any_has(monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[Any] = []
    monkeypatch.setattr(console, "print_table", lambda *given: printed.extend(given))
    console.print_metrics([("one", [("a", "1 m"), ("b", "2 m")]), ("two", [("b", "3 m"), ("c", "4 m")])])
    assert printed == [["", "one", "two"], [("a", "1 m", ""), ("b", "2 m", "3 m"), ("c", "", "4 m")]]


def test_a_claim_that_the_repaired_law_misses_is_yellow(monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[Any] = []
    monkeypatch.setattr(comparing, "print_table", lambda _, rows, **__: printed.extend(rows))
    results = load(Path(__file__).parents[2] / "docs" / "results.json")
    comparing.print_tables(results)
    held = [claim.holds(of_law(REPAIRED, results)) for claim in CLAIMS]
    assert [not row[1].startswith("[yellow]") for row in printed] == held
    assert not all(held)


@pytest.mark.parametrize("key", OVERRIDES)
def test_every_datum_that_may_replace_that_of_a_vessel_does(monkeypatch: pytest.MonkeyPatch, tmp_path: Any, key: str) -> None:
    given: list[Any] = []

    def scenario_for(*arguments: Any) -> str:
        given.extend(arguments)
        return "text"

    monkeypatch.setattr(boat, "scenario_for", scenario_for)
    assert boat._text("otter", tmp_path / "boat.yaml", {key: 7.5, "wind": 3.5}, True, ()) == "text"
    values, reference, name, own, main, thrusters = given
    assert (reference, name, own[key], thrusters) == ("otter", "boat", 7.5, True)
    assert "vessel.length" in values
    assert getattr(main, key) == 7.5


@pytest.mark.parametrize(("lines", "code"), [([], 0), (["it differs"], 1)])
def test_a_repeated_row_that_differs_has_the_exit_code_of_a_difference(
    capsys: pytest.CaptureFixture[str], lines: list[str], code: int
) -> None:
    arguments: list[Any] = []

    def differences(*given: Any) -> list[str]:
        arguments.extend(given)
        return lines

    row: Any = SimpleNamespace(run=7, values={"ended_early": False}, differences=differences)
    result: Any = SimpleNamespace(metrics="metrics", failure="failure", exit_code=3)
    assert compare_with_row(row, result) == code
    assert arguments == ["metrics", "failure"]
    captured = capsys.readouterr()
    assert ("error: row 7: it differs" in captured.err) == bool(lines)
    assert ("bit-identical to those of row 7" in captured.out) != bool(lines)
    unknown: Any = SimpleNamespace(run=7, values={})
    assert compare_with_row(unknown, result) == 3


def test_numbers_that_are_not_finite_are_null_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    print_json({"a": math.nan, "b": [math.inf, -math.inf, np.float64(1.5)], "c": "N·m"})
    text = capsys.readouterr().out
    assert json.loads(text, parse_constant=lambda name: pytest.fail(name)) == {"a": None, "b": [None, None, 1.5], "c": "N·m"}
    assert "N·m" in text
