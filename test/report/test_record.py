"""What the metrics of a record count."""

from dataclasses import replace

import numpy as np
import pytest
from records import circle, make_run

from vessel_hsmc_ros.report import Record
from vessel_hsmc_ros.report.record import Mark, control_intervals, measured

PAUSES = (Mark(1.0, "pause", ""), Mark(2.0, "resume", ""), Mark(5.0, "pause", ""), Mark(9.0, "resume", ""))


@pytest.mark.parametrize(("marks", "settled"), [((), 12.0), (PAUSES[:2], 11.0), (PAUSES[2:], 8.0), (PAUSES, 7.0)])
def test_no_pause_counts_in_the_settling_time(marks: tuple[Mark, ...], settled: float) -> None:
    time = np.arange(0.0, 60.0, 0.01)
    reference = np.zeros((len(time), 6))
    state = reference.copy()
    state[:, 0] = np.where(time < 12.0, 10.0, 0.0)
    metrics = measured(make_run(time, state, reference=reference, wrench=np.zeros((len(time), 2))), None, marks)
    assert metrics is not None
    assert metrics.settling_time == pytest.approx(settled, abs=0.02)


def test_intervals_of_the_control_that_a_pause_interrupts_are_left_out() -> None:
    run = circle(1.0)
    times = np.array([0.0, 0.1, 0.2, 1.2, 1.3, 1.4, 3.4, 3.5])
    paused = Record("run", replace(run, control={"time": times, "compute_time": 0.0 * times}))
    marks = (Mark(0.25, "pause", ""), Mark(1.15, "resume", ""), Mark(1.45, "pause", ""), Mark(3.35, "resume", ""))
    assert control_intervals(replace(paused, marks=marks))[1] == pytest.approx(0.1)
    assert len(control_intervals(paused)[1]) == 7
