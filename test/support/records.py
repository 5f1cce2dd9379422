"""Records of synthetic runs, for tests of reports."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.report import Record
from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.scenario.scenario import load_scenario

Array = NDArray[Any]

SAMPLES = 500
PERIOD = 0.01


def make_run(time: Array, state: Array, **known: Any) -> Run:
    """A run of which only the given quantities were recorded."""

    def unknown(columns: int) -> Array:
        return np.full((len(time), columns), np.nan)

    arrays = {
        "measured": state,
        "reference": unknown(6),
        "wrench": unknown(2),
        "disturbance": unknown(3),
        "unforced_acceleration": unknown(3),
    }
    return Run(time, state, **{**arrays, **known})


def circle(offset: float, samples: int = SAMPLES) -> Run:
    """A ship on a circle at a constant distance from its reference."""
    time = np.arange(samples) * PERIOD
    reference = np.column_stack([50 * np.cos(time), 50 * np.sin(time), time, 0 * time + 2, 0 * time, 0 * time + 0.1])
    return make_run(
        time,
        reference + np.array([offset, 0.0, 0.0, 0.0, 0.0, 0.0]),
        reference=reference,
        wrench=np.column_stack([1e5 * np.sin(time), 1e6 * np.cos(time)]),
        control={
            "time": time[::2],
            "surge_estimate": np.sin(time[::2]),
            "yaw_weights": np.ones((len(time[::2]), 3)),
        },
    )


def record(name: str, offset: float, samples: int = SAMPLES, **changes: Any) -> Record:
    """The record of a ship on a circle, with the scenario of case 2."""
    run = circle(offset, samples)
    scenario = load_scenario("case2_tracking", changes)
    return Record(name, run, measured(run, scenario), {}, scenario, {"version": "9.9"})
