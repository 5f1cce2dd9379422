"""Tables of metrics, differences and parameters."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from records import circle, record

from vessel_hsmc_ros.core.metrics import evaluate, held
from vessel_hsmc_ros.report import Record
from vessel_hsmc_ros.report.record import Mark, measured
from vessel_hsmc_ros.report.tables import MetricRow, metrics_table, parameter_tables


def row_of(records: list[Record], label: str) -> MetricRow:
    return next(row for row in metrics_table(records) if row.label == label)


def changed_parameters(records: list[Record]) -> set[str]:
    return {f"{node['name']}.{row['name']}" for node in parameter_tables(records) for row in node["rows"] if row["changed"]}


def test_metrics_of_several_runs_are_compared_with_the_first() -> None:
    row = row_of([record("near", 1.0), record("far", 4.0)], "position error, rms with the approach")
    assert [row.text(0), row.text(1)] == ["1 m", "4 m"]
    assert row.difference(1) == "+3 m (+300 %)"
    assert (row.sense(0), row.sense(1)) == ("", "worse")


def test_the_table_begins_with_the_last_quarter_and_keeps_its_order_whatever_the_first_run_lacks() -> None:
    settled, lost = record("near", 0.0), record("far", 1.0)
    assert lost.metrics is not None
    without = replace(lost, metrics=lost.metrics._replace(settling_time=None))
    orders = [[row.label for row in metrics_table(runs)] for runs in ([settled, without], [without, settled])]
    assert orders[0] == orders[1]
    assert orders[0][0] == "position error, rms of the last quarter"


def test_a_difference_within_a_percent_is_neither_better_nor_worse() -> None:
    row = row_of([record("near", 1.0), record("next", 1.005)], "position error, rms with the approach")
    assert row.difference(1) == "+5 mm (+0.5 %)"
    assert row.sense(1) == ""


@pytest.mark.parametrize(
    ("first", "other", "sense"),
    [
        (1.0, -5.0, "worse"),
        (-1.0, -5.0, "worse"),
        (-1.0, 5.0, "worse"),
        (5.0, -1.0, "better"),
        (-5.0, -1.0, "better"),
        (5.0, -5.0, ""),
    ],
)
def test_of_a_metric_with_a_sign_the_one_nearer_to_zero_is_better(first: float, other: float, sense: str) -> None:
    runs = []
    for name, value in (("first", first), ("other", other)):
        made = record(name, 1.0)
        assert made.metrics is not None
        runs.append(replace(made, metrics=made.metrics._replace(heading_error_final_deg=value)))
    assert row_of(runs, "heading error, final").sense(1) == sense


def test_a_difference_from_nearly_zero_is_not_expressed_in_percent() -> None:
    assert row_of([record("near", 1e-3), record("far", 4.0)], "position error, rms with the approach").difference(1) == "+4 m"


def test_facts_of_every_run_are_shown_in_its_own_column() -> None:
    first = Record("first", circle(1.0), facts={"missed_periods": 3, "messages_recorded": 700})
    second = Record("second", circle(1.0), facts={"missed_periods": 8, "messages_dropped": 1})
    shown = {row.label: (row.text(0), row.text(1), row.difference(1)) for row in metrics_table([first, second])}
    assert shown["control periods missed"] == ("3", "8", "+5")
    assert shown["messages recorded"] == ("700", "–", "")
    assert shown["messages dropped"] == ("–", "1", "")


def test_runs_of_different_duration_are_compared_over_the_interval_that_both_cover() -> None:
    long, short = record("long", 1.0, samples=500), record("short", 2.0, samples=201)
    late = long.run.time > 2.005
    long.run.state[late, 0] += 100.0  # an error that only the longer run has time for
    assert row_of([long, short], "position error, rms with the approach").text(0) == "1 m"
    assert row_of([long, short], "duration of the run").text(0) == "4.99 s"
    assert row_of([long, short], "metrics above: over the first, which all runs share").text(1) == "2 s"


def test_metrics_of_runs_of_equal_duration_cover_the_whole_run() -> None:
    near = record("near", 1.0)
    run = near.run
    labels = [row.label for row in metrics_table([near, record("far", 2.0)])]
    assert near.metrics == evaluate(run.time, run.state, run.reference, run.wrench)
    assert not any("duration" in label for label in labels)


def test_the_time_of_a_pause_does_not_count_as_time_to_settle() -> None:
    run = circle(0.0)
    run.state[:100, 0] += 10.0
    paused = replace(run, time=np.where(run.time >= 0.5, run.time + 60.0, run.time))
    marks = (Mark(0.495, "pause", "paused"), Mark(60.495, "resume", "running"))
    without, with_marks = measured(run), measured(paused, marks=marks)
    assert without is not None
    assert with_marks is not None
    assert with_marks.settling_time == pytest.approx(without.settling_time) == pytest.approx(1.0)


def test_parameters_that_differ_between_runs_are_marked() -> None:
    changed_weight: dict[str, Any] = {"controller.hierarchical_printed.sway_weight": 0.002}
    records = [record("near", 1.0), record("far", 4.0, **changed_weight)]
    assert changed_parameters(records) == {"controller.hierarchical_printed.sway_weight"}


def test_parameters_of_a_single_run_are_marked_where_they_differ_from_their_defaults() -> None:
    faster: dict[str, Any] = {"vessel_sim.rate_hz": 200.0}
    changed = changed_parameters([record("one", 1.0, **faster)])
    assert "vessel_sim.rate_hz" in changed
    assert "controller.rate_hz" not in changed


def test_a_run_without_a_reference_has_no_metrics_and_no_differences() -> None:
    unknown = Record("unknown", circle(1.0), None)
    row = row_of([unknown, record("known", 1.0)], "position error, rms with the approach")
    assert (row.text(0), row.text(1), row.difference(1), row.sense(1)) == ("–", "1 m", "", "")


@pytest.mark.parametrize("order", [1, -1])
def test_samples_in_any_order_are_held_until_the_next(order: int) -> None:
    times, values = np.array([1.0, 2.0, 3.0])[::order], np.array([10.0, 20.0, 30.0])[::order]
    np.testing.assert_array_equal(held(times, values, np.array([0.0, 1.0, 2.9, 3.0, 9.0])), [10.0, 10.0, 20.0, 30.0, 30.0])
