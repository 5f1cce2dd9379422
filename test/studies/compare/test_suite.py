import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.scenario.named_files import SUITES
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import load_scenario, parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.studies.suite import Row, judge, load_suite


def run_with(distance: Callable[[float], float]) -> Run:
    """A run of 100 s with a given position error as a function of time, 101 samples."""
    time = np.linspace(0.0, 100.0, 101)
    state = np.zeros((101, 6))
    state[:, 0] = [distance(t) for t in time]
    wrench, accelerations = np.zeros((101, 2)), np.zeros((101, 3))
    return Run(time, state, state, np.zeros((101, 6)), wrench, accelerations, accelerations)


def suite(tmp_path: Path, text: str) -> tuple[Row, ...]:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    return load_suite(path)


def test_the_rows_of_every_suite_load() -> None:
    for name in SUITES.names():
        rows = load_suite(name)
        assert len({row.name for row in rows}) == len(rows)
        # Rows of the smallest and of the largest ship are enough: those between have the same numbers in units of their ships.
        between = [*(yaml.safe_load(SUITES.path(name).read_text()).get("ships") or {})][1:-1]
        for row in rows:
            if row.name.rpartition(", ")[2] not in between:
                load_scenario(row.scenario, row.changes)


def test_the_changes_of_a_row_override_the_shared_ones(tmp_path: Path) -> None:
    text = "set: {a.b: 1, c.d: 2}\nrows:\n  - {name: one, set: {a.b: 3}, over: last_half, at_most: 1e-2, largest: 1}\n"
    (row,) = suite(tmp_path, text)
    assert row == Row("one", "case2_tracking", {"a.b": 3, "c.d": 2}, "last_half", at_most=0.01, largest=1.0)


def test_an_entry_with_variants_stands_for_a_row_for_each(tmp_path: Path) -> None:
    text = """
variants: {slow: {a.b: 3}, fast: {a.b: 4}, other: {}}
rows:
  - {name: one, set: {a.b: 1, c.d: 2}, variants: [slow, fast], at_most: 1}
  - {name: two}
"""
    slow, fast, two = suite(tmp_path, text)
    assert slow == Row("one, slow", changes={"a.b": 3, "c.d": 2}, at_most=1.0)
    assert fast == Row("one, fast", changes={"a.b": 4, "c.d": 2}, at_most=1.0)
    assert two == Row("two")


def test_the_position_error_is_evaluated_in_the_window_of_the_row() -> None:
    run = run_with(lambda t: 8.0 if t < 50.0 else 4.0 if t < 75.0 else 2.0)
    assert judge(Row("q"), run) == (2.0, 2.0, 1.0, math.inf, True)
    verdict = judge(Row("h", over="last_half"), run)
    assert verdict.rms == pytest.approx(np.sqrt((25 * 16.0 + 26 * 4.0) / 51))
    assert verdict.largest == 4.0


def test_the_window_of_a_run_that_does_not_begin_at_zero_is_that_of_its_own_time() -> None:
    run = run_with(lambda t: 8.0 if t < 50.0 else 4.0 if t < 75.0 else 2.0)
    for begin in (-30.0, 1000.0):
        shifted = replace(run, time=run.time + begin)
        for over in ("last_quarter", "last_half"):
            assert judge(Row("r", over=over), shifted) == judge(Row("r", over=over), run)


def test_the_excursion_is_that_of_the_entire_run() -> None:
    run = run_with(lambda t: 2.0 if t < 20.0 else 6.0 if t < 30.0 else 1.0)
    assert judge(Row("r", excursion=2.9), run)[2:] == (3.0, math.inf, False)


@pytest.mark.parametrize(
    ("limits", "hit"),
    [
        ({"at_most": 2.0}, True),
        ({"at_most": 1.99}, False),
        ({"at_most": 2.0, "largest": 1.9}, False),
        ({"excursion": 1.5}, True),
        ({"excursion": 1.4}, False),
    ],
)
def test_a_row_is_hit_when_every_limit_holds(limits: dict[str, Any], hit: bool) -> None:
    run = run_with(lambda t: 4.0 if t < 10.0 else 6.0 if t < 50.0 else 2.0)
    assert judge(Row("r", **limits), run).hit is hit


def test_a_run_that_is_not_finite_is_a_miss() -> None:
    assert not judge(Row("r", at_most=1.0), run_with(lambda t: np.nan * t)).hit


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("rows: 3", "is not a suite"),
        ("rows: []\nrow: []", "is not a suite"),
        ("rows: [", "cannot be read"),
        ("rows: [{set: {}}]", "row must have a name"),
        ("rows: [{name: a, atmost: 1}]", "row must have a name and any of scenario, set, over"),
        ("rows: [{name: a, over: last}]", "over of row a must be one of last_quarter, last_half.*got last"),
        ("rows: [{name: a, at_most: -1}]", "at_most of row a must be a number above 0.*got -1"),
        ("variants: {b: {}}\nrows: [{name: a, variants: [b, c]}]", "variant c of row a is unknown: the suite has b"),
        ("rows: [{name: a, variants: 3}]", "variants of row a must be a list of names.*got 3"),
        ("variants: [b]\nrows: []", "variants of suite file .* must be changes by name"),
        ("rows: [{name: a, largest: true}]", "largest of row a must be .*got True"),
        ("rows: [{name: a, at_most: .inf}]", "at_most of row a must be .*got inf"),
        ("rows: [{name: a, set: text}]", "set of row a .*got text"),
        ("set: [1]\nrows: [{name: a}]", "set of suite file .*got .1"),
        ("rows: [{name: a, over: [1]}]", "over of row a must be .*got .1"),
    ],
)
def test_a_malformed_suite_is_rejected_with_the_reason(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        suite(tmp_path, text)


def test_an_unknown_suite_is_rejected_with_the_known_names() -> None:
    with pytest.raises(ScenarioError, match="suite quick is unknown: it must be one of boats, guided"):
        load_suite("quick")


SHIPS = """
ships:
  small: {length: 2.0, mass: 64.0, surge_force_limit: 30.0, yaw_moment_limit: 12.0}
  large: {length: 20.0, mass: 64.0e+3, surge_force_limit: 3.0e+4, yaw_moment_limit: 1.2e+5}
"""


def test_a_row_with_ships_stands_for_the_scenario_of_each_as_init_writes_it(tmp_path: Path) -> None:
    rows = suite(
        tmp_path,
        f"{SHIPS}set: {{vessel_sim.duration: 5.0}}\nrows:\n  - {{name: circle, ships: [small, large], at_most: {{L: 0.05}}}}",
    )
    assert [(row.name, row.at_most) for row in rows] == [("circle, small", 0.1), ("circle, large", 1.0)]
    data = MainData(length=2.0, mass=64.0, surge_force_limit=30.0, yaw_moment_limit=12.0)
    written = parse_scenario(scenario_text("small", data), "small").changed({"vessel_sim.duration": 5.0})
    small = load_scenario(rows[0].scenario, rows[0].changes)
    for node in ("vessel_sim", "reference_ship"):
        assert getattr(small, node) == getattr(written, node)
    assert small.controller.vessel == written.controller.vessel


def test_numbers_of_a_row_may_be_in_the_units_of_its_ship(tmp_path: Path) -> None:
    given = "{a.b: {L: [1, 2.5]}, c.d: {U: 0.5}, e.f: {T: 2}, g.h: {L/U: 10}, i.j: 3.0}"
    (row,) = suite(tmp_path, f"{SHIPS}rows:\n  - {{name: one, ships: [large], set: {given}}}")
    scale = scale_of(load_scenario("case2_tracking", {k: v for k, v in row.changes.items() if len(k) > 3}).vessel_sim.vessel)
    assert (row.changes["a.b"], row.changes["i.j"]) == ([20.0, 50.0], 3.0)
    assert (row.changes["c.d"], row.changes["e.f"]) == (0.5 * scale.U, 2.0 * scale.T)
    assert row.changes["g.h"] == pytest.approx(10.0 * scale.L / scale.U)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("{name: one, ships: [middle]}", r"ships of row one must be .* small, large \(got \['middle'\]\)"),
        ("{name: one, ships: small}", "ships of row one must be .*got small"),
        (
            "{name: one, ships: [small], set: {a.b: {N: 1}}}",
            r"a.b of row one, small must be {L\|U\|T\|L/U",
        ),
        ("{name: one, ships: [small], set: {a.b: {L: far}}}", r"a.b of row one, small must be .*got \{'L': 'far'\}"),
        ("{name: one, set: {a.b: {L: 1}}}", r"a.b of row one must be without a unit.*got \{'L': 1\}"),
        ("{name: one, ships: [small], at_most: {L: 0}}", r"at_most of row one, small must be .*got \{'L': 0\}"),
    ],
)
def test_a_wrong_ship_or_unit_is_one_line_that_names_it(tmp_path: Path, row: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        suite(tmp_path, f"{SHIPS}rows:\n  - {row}")


def test_main_data_out_of_range_name_the_ship(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"ship odd: ships.length must be .*got -1.0"):
        suite(tmp_path, "ships: {odd: {length: -1.0}}\nrows:\n  - {name: one, ships: [odd]}")
