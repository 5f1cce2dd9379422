"""Comparison and demonstration in numbers: metrics, tables, files and figures of runs that are all unlike."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from records import make_run

from vessel_hsmc_ros.cli import comparing
from vessel_hsmc_ros.core.metrics import Metrics, Run
from vessel_hsmc_ros.core.node_list import taking_part
from vessel_hsmc_ros.nodes.runs.processes import spread
from vessel_hsmc_ros.report import Record, page
from vessel_hsmc_ros.report.diagrams import spans
from vessel_hsmc_ros.report.page import WrittenFiles
from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies import comparison
from vessel_hsmc_ros.studies.batch import thinned
from vessel_hsmc_ros.studies.comparison import LawMetrics, LawRun, measure
from vessel_hsmc_ros.studies.scenario_run import conclusions
from vessel_hsmc_ros.studies.suite import WINDOWS, Row, Verdict, judge

Array = NDArray[Any]

TIME = 5.0 + np.arange(0.0, 400.25, 0.25)
LIMITED = load_scenario(
    "case2_tracking",
    {
        "controller.law": "guided",
        "vessel_sim.actuators.surge_force_limit": 4e5,
        "vessel_sim.actuators.yaw_moment_limit": 1e6,
    },
)


def falling(force: Array, moment: Array) -> Run:
    """A position error of 8 m, of 4 m from 100 s on and of 2 m from 320 s on, and half of it at the end; the heading likewise."""
    since = TIME - TIME[0]
    error = np.select([since < 100.0, since < 320.0, since < 400.0], [8.0, 4.0, 2.0], 1.0)
    zero = 0.0 * TIME
    reference = np.column_stack([2.0 * TIME, 3.0 * TIME, zero + 3.0, zero, zero, zero])
    state = reference.copy()
    state[:, 0] += 0.6 * error
    state[:, 1] -= 0.8 * error
    state[:, 2] += np.radians(10.0 * error)  # beyond pi
    return make_run(TIME, state, reference=reference, wrench=np.column_stack([force, moment]))


@pytest.mark.parametrize(
    ("over", "rms", "largest", "since"), [("last_quarter", (20 * 16 + 80 * 4) / 100, 4.0, 300.0), ("last_half", 11.2, 4.0, 200.0)]
)
def test_every_metric_of_a_law_is_known_beforehand(over: str, rms: float, largest: float, since: float) -> None:
    # In the first 100 s the moment chatters; later the force does, with half a hertz.
    early = TIME - TIME[0] < 100.0
    force = np.where(early, 3e4, 3e4 + 1e4 * np.sign(np.sin(np.pi * TIME + 0.5)))
    moment = np.where(early, 2e5 * np.sign(np.sin(4.0 * np.pi * TIME + 0.5)), 1e5)
    row, run = Row("row", over=over), falling(force, moment)
    found = measure(row, run, LIMITED, judge(row, run)._replace(legs=7.5))
    expected = LawMetrics(
        position_rms=math.sqrt(rms),
        position_largest=largest,
        position_final=1.0,
        heading_rms_deg=10.0 * math.sqrt(rms),
        surge_force_rms=math.sqrt(float(np.mean(force**2))),
        yaw_moment_rms=math.sqrt(float(np.mean(moment**2))),
        reversals=1.0,
        # The limit of the law for the force, that of the actuator for the moment.
        travel=float(np.sum(np.abs(np.diff(force)))) / 2e5 / (400.0 / 60.0)
        + float(np.sum(np.abs(np.diff(moment)))) / 1e6 / (400.0 / 60.0),
        legs=7.5,
    )
    assert found == pytest.approx(expected, rel=5e-3)
    assert since == WINDOWS[over] * 400.0


def test_a_law_without_limits_has_no_travel_and_a_run_without_legs_no_error_on_them() -> None:
    run = falling(0.0 * TIME, 0.0 * TIME)
    found = measure(Row("row"), run, load_scenario("case2_tracking"), judge(Row("row"), run))
    assert math.isnan(found.travel)
    assert found.legs is None


def test_the_reversals_of_a_short_run_are_those_of_its_last_quarter() -> None:
    run = falling(np.where(TIME[0] + 150.0 > TIME, np.sign(np.sin(np.pi * TIME + 0.5)), 0.0), 0.0 * TIME)
    short = Run(**{name: getattr(run, name)[:721] for name in run.__dataclass_fields__ if name != "control"})
    assert measure(Row("row"), short, LIMITED, judge(Row("row"), short)).reversals == pytest.approx(15.0 / 45.0, abs=0.03)


def test_the_lines_of_the_figures_are_time_ship_reference_and_error() -> None:
    run = falling(0.0 * TIME, 0.0 * TIME)
    error = np.hypot(*(run.state - run.reference)[:, :2].T)
    lines = comparison._lines(run)
    np.testing.assert_allclose(lines, np.column_stack([run.time, run.state[:, :2], run.reference[:, :2], error]))


METRICS = LawMetrics(1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5)
VERDICT = Verdict(1.5, 2.5, 10.5, 9.5, hit=True)
ROW = Row("case", "case2_straight", {"a.x": (1.0, 2.0)}, "last_half", 11.5, 12.5, 13.5, 14.5)
LINES = np.column_stack([np.arange(5.0) + offset for offset in (0.0, 10.0, 20.0, 30.0, 40.0, 50.0)])
OUTCOME = LawRun(ROW, "guided", 25.0, True, "", METRICS, VERDICT, LINES)


def test_the_document_of_a_comparison_has_every_value_under_its_own_name() -> None:
    assert comparison._record(OUTCOME) == {
        "case": "case",
        "scenario": "case2_straight",
        "set": {"a.x": [1.0, 2.0]},
        "over": "last_half",
        "limits": {"at_most": 11.5, "largest": 12.5, "excursion": 13.5, "legs_at_most": 14.5},
        "law": "guided",
        "rate_hz": 25.0,
        "failure": "",
        **METRICS._asdict(),
        "excursion": 10.5,
        "verdict": "hit",
    }
    stopped = comparison._record(LawRun(ROW, "guided", 25.0, failure="it failed"))
    assert (stopped["failure"], stopped["verdict"], stopped["excursion"]) == ("it failed", "miss", None)


def test_the_tables_of_a_comparison_show_every_metric_in_its_own_column() -> None:
    head, lines = comparison.table(ROW, [OUTCOME])
    assert dict(zip(head, lines[0], strict=True)) == {
        "law": "guided",
        "Hz": "25",
        "rms m": "1.5",
        "largest m": "2.5",
        "final m": "3.5",
        "heading °": "4.5",
        "force N": "5.5",
        "moment N·m": "6.5",
        "rev/s": "7.5",
        "travel/min": "8.5",
        "legs m": "9.5",
        "verdict": "hit",
    }
    other = replace(OUTCOME, law="los_pid", metrics=METRICS._replace(position_rms=0.5, position_largest=0.6, travel=0.7))
    found = {
        each.title: each.lines for each in comparison.overviews([OUTCOME, replace(other, verdict=VERDICT._replace(hit=False))])
    }
    first = ["case", "last half", "11.5 m, largest 12.5 m, excursion 13.5, legs 14.5 m"]
    assert found == {
        "rms position error": [[*first, "1.5 m, legs 9.5 m hit", "0.5 m, legs 9.5 m miss"]],
        "largest position error": [[*first[:2], "2.5 m", "0.6 m"]],
        "actuator travel [1/min]": [[*first[:2], "8.5", "0.7"]],
    }
    assert comparison._scope(ROW) == f"Errors over the last half, at most {first[2]}"


def test_a_comparison_ranks_its_laws_in_a_sentence_or_counts_their_limits() -> None:
    runs = [
        replace(OUTCOME, law=law, metrics=None if rms is None else METRICS._replace(position_rms=rms))
        for law, rms in (("hierarchical", 16.6), ("nmpc", None), ("guided", 0.002))
    ]
    assert comparison.findings(runs) == [
        "On case guided is the most accurate (2 mm rms), before hierarchical (16.6 m rms), nmpc (stopped)."
    ]
    assert comparison.findings(runs[:1]) == []
    many = [replace(run, row=replace(ROW, name=f"case {k}")) for k in range(4) for run in runs[:1]]
    assert comparison.findings(many) == ["hierarchical meets 4 of 4 limits."]


def test_a_column_has_the_unit_of_its_largest_value_in_whatever_row() -> None:
    small = replace(OUTCOME, law="los_pid", metrics=METRICS._replace(surge_force_rms=0.25, position_final=-0.004))
    large = replace(OUTCOME, metrics=METRICS._replace(surge_force_rms=2.5e6))
    for order in ([small, large], [large, small]):
        head, lines = comparison.table(ROW, order)
        assert "force MN" in head
        assert {line[0]: line[head.index("force MN")] for line in lines}["guided"] == "2.5"


def test_every_law_that_ran_at_another_rate_and_every_failure_is_noted() -> None:
    runs = [
        replace(OUTCOME, fell_back=False),
        replace(OUTCOME, law="hierarchical_printed", rate_hz=100.0),
        LawRun(Row("second"), "los_pid", 25.0, failure="it failed"),
    ]
    assert comparison.notes(runs) == [
        "hierarchical_printed is unstable at the requested rate and ran at 100 Hz",
        "los_pid on second: it failed",
    ]


def test_the_figures_of_a_case_have_tracks_reference_errors_and_its_limit() -> None:
    found = comparison.figures_of(ROW, [OUTCOME, LawRun(ROW, "los_pid", 25.0, failure="it failed")])
    tracks, errors = ({t["name"]: np.transpose([t["x"], t["y"]]).tolist() for t in each["traces"]} for each in found)
    assert tracks["guided"] == [[10.0 + k, 20.0 + k] for k in range(5)]
    assert tracks["reference"] == [[30.0 + k, 40.0 + k] for k in range(5)]
    assert errors["guided"] == [[0.0 + k, 50.0 + k] for k in range(5)]
    (limit,) = found[1]["layout"]["shapes"]
    assert (limit["y0"], limit["name"]) == (11.5, "limit")


@pytest.mark.parametrize(
    ("values", "wide"), [((0.1, 10.0), True), ((-0.1, 10.0), False), ((0.0, 10.0), False), ((1.0, 20.0), False)]
)
def test_only_positive_values_far_apart_have_a_logarithmic_scale(values: tuple[float, ...], wide: bool) -> None:
    assert spans(np.array([*values, math.nan, math.inf])) is wide


def test_a_law_that_converges_is_judged_from_its_first_to_its_last_error() -> None:
    time = np.linspace(0.0, 100.0, 1001)
    state = np.zeros((1001, 6))
    state[:, 0] = 0.2 + 19.8 * (time < 50.0)
    state[:, 2] = math.radians(-40.0)
    reference = np.zeros((1001, 6))
    reference[:, 0] = 0.1 * (time > 90.0)
    run = make_run(time, state, reference=reference, wrench=np.ones((1001, 2)))
    (found,) = conclusions([Record("los_pid", run, measured(run))])
    assert found.startswith("los_pid converges to the reference: the position error falls from 20 m to 0.")
    lost = replace(run, state=state + np.array([9.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    (found,) = conclusions([Record("los_pid", lost, measured(lost))])
    assert found.endswith("while the heading error is 4e+01° at the end.")  # and no cause of another law


def test_of_a_thinned_run_every_array_is_thinned() -> None:
    run = falling(TIME, -TIME)
    run = replace(run, control={"time": TIME[::2], "a": TIME[::2] ** 2, "wide": np.column_stack([TIME[::2], -TIME[::2]])})
    found = thinned(run, 7)
    for name in run.__dataclass_fields__:
        if name != "control":
            np.testing.assert_array_equal(getattr(found, name), getattr(run, name)[::7], name)
    assert {name: values.tolist() for name, values in found.control.items()} == {
        name: values[::7].tolist() for name, values in run.control.items()
    }


def test_recorded_runs_are_compared_under_their_own_names(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    scale = Metrics(*np.arange(1.0, 20.0))
    runs = [
        Record(name, make_run(TIME, np.zeros((len(TIME), 6))), Metrics(*(factor * (value or 0.0) for value in scale)))
        for name, factor in (("one", 1.0), ("two", 3.0))
    ]
    printed: list[Any] = []
    monkeypatch.setattr(page, "read", lambda _: runs)
    monkeypatch.setattr(page, "write_files", lambda records, _: WrittenFiles(records, {}))
    monkeypatch.setattr(comparing, "print_table", lambda *given: printed.extend(given))
    comparing.compare_runs([], tmp_path / "report.html")
    head, table = printed
    assert head == ["", "one", "two"]
    assert ("position error, final", "3 m", "9 m") in table


@pytest.mark.parametrize(
    ("count", "lockstep", "grouped"), [(1, True, False), (4, True, False), (5, True, True), (5, False, False)]
)
def test_only_large_fleets_in_lockstep_share_processes(
    monkeypatch: pytest.MonkeyPatch, count: int, lockstep: bool, grouped: bool
) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1, 2})
    vessels = [f"vessel_{number + 1}" for number in range(count)]
    found = spread(vessels, by_thrusters=False, lockstep=lockstep)
    assert sorted(node for part in found.values() for node in part) == sorted(taking_part(False, vessels))
    if not grouped:
        assert all([name] == [*part] for name, part in found.items())
        return
    assert [*found] == ["recorder", "group_1", "group_2", "group_3"]
    plants = {name: [node for node in part if node.endswith("vessel_sim")] for name, part in found.items()}
    assert plants == {
        "recorder": [],
        "group_1": ["vessel_1/vessel_sim", "vessel_4/vessel_sim"],
        "group_2": ["vessel_2/vessel_sim", "vessel_5/vessel_sim"],
        "group_3": ["vessel_3/vessel_sim"],
    }
