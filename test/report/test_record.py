"""What the metrics of a record count."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from records import circle, make_run, record

from vessel_hsmc_ros.report.panels import tracks
from vessel_hsmc_ros.report.record import Mark, control_intervals, measured, running_time
from vessel_hsmc_ros.scenario.scenario import load_scenario

PAUSES = (Mark(1.0, "pause", ""), Mark(2.0, "resume", ""), Mark(5.0, "pause", ""), Mark(9.0, "resume", ""))


THREE = (*PAUSES, Mark(11.0, "pause", ""), Mark(11.25, "resume", ""))


@pytest.mark.parametrize(("marks", "settled"), [((), 12.0), (PAUSES[:2], 11.0), (PAUSES[2:], 8.0), (PAUSES, 7.0), (THREE, 6.75)])
def test_no_pause_counts_in_the_settling_time(marks: tuple[Mark, ...], settled: float) -> None:
    time = np.arange(0.0, 60.0, 0.01)
    reference = np.zeros((len(time), 6))
    state = reference.copy()
    state[:, 0] = np.where(time < 12.0, 10.0, 0.0)
    metrics = measured(make_run(time, state, reference=reference, wrench=np.zeros((len(time), 2))), None, marks)
    assert metrics is not None
    assert metrics.settling_time == pytest.approx(settled, abs=0.02)


@given(st.lists(st.tuples(st.floats(0.1, 3.0), st.floats(0.1, 3.0)), max_size=6))
def test_the_running_time_is_that_outside_of_the_pauses_at_every_time(parts: list[tuple[float, float]]) -> None:
    marks, outside, at = [], [], 0.0
    for running, paused in parts:
        outside.append((at, at + running))
        marks += [Mark(at + running, "pause", ""), Mark(at + running + paused, "resume", "")]
        at += running + paused
    outside.append((at, np.inf))
    time = np.linspace(0.0, at + 5.0, 400)
    expected = sum(np.clip(time - begin, 0.0, end - begin) for begin, end in outside)
    np.testing.assert_allclose(running_time(time, marks), expected, atol=1e-9)


def test_intervals_of_the_control_that_a_pause_interrupts_are_left_out() -> None:
    run = circle(1.0)
    times = np.array([0.0, 0.1, 0.2, 1.2, 1.3, 1.4, 3.4, 3.5])
    paused = replace(run, control={"time": times, "compute_time": 0.0 * times})
    marks = (Mark(0.25, "pause", ""), Mark(1.15, "resume", ""), Mark(1.45, "pause", ""), Mark(3.35, "resume", ""))
    assert control_intervals(paused, marks)[1] == pytest.approx(0.1)
    assert len(control_intervals(paused, ())[1]) == 7


def test_commands_after_the_evaluated_interval_do_not_count() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    state = np.zeros((len(time), 6))
    command = np.where(time < 10.0, 0.0, 1e9)
    control = {"time": time, "compute_time": 0.0 * time, "commanded": np.column_stack([command, command])}
    run = make_run(time, state, reference=state, wrench=np.zeros((len(time), 2)), control=control)
    scenario = load_scenario("case2_tracking", {"controller.law": "guided"})
    whole, half = measured(run, scenario), measured(run, scenario, until=9.9)
    assert whole is not None
    assert half is not None
    assert (whole.surge_force_at_limit, whole.yaw_moment_at_limit) == pytest.approx((0.5, 0.5), abs=0.01)
    assert (half.surge_force_at_limit, half.yaw_moment_at_limit) == (0.0, 0.0)


def test_only_references_of_the_same_values_are_drawn_as_one() -> None:
    near, far = record("near", 1.0), record("far", 2.0)
    shifted = replace(far, run=replace(far.run, reference=far.run.reference + 5.0))
    assert [track.role for track in tracks([near, far])] == ["ship", "ship", "reference"]
    assert [track.label for track in tracks([near, shifted])][2:] == ["near: reference", "far: reference"]
