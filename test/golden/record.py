"""Golden runs: the recorded behaviour of every scenario, thinned to a few kilobytes of text.

Tolerances: another processor or NumPy may round sine, exponential and sums differently, by about
1e-16 of a value, in every one of 40 000 steps: for positions of some ten metres a random walk below 1e-12 m. The closed loop
amplifies it as any small deviation, at most 200 times: on the circle, the most unstable of all cases.
That is below 1e-9, and 1e-8 is allowed. The wrench follows from the state by a gain: m11·k2 = 1.2e7 N per m/s and
m33·k1 = 6.4e9 N·m per rad/s.

A relevant change is far above that: a gain that differs by 1e-6 is detected (`test_golden_offline.py`).
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vessel_hsmc_ros.core.metrics import Run, evaluate, heading_error, position_error, rms
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

Array = NDArray[np.float64]
Metrics = Mapping[str, float | None]
Record = dict[str, Any]

FOLDER = Path(__file__).parent
TIMES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, *range(20, 401, 20))
COLUMNS = ("time", "x", "y", "psi", "u", "v", "r", "x_d", "y_d", "psi_d", "u_d", "v_d", "r_d", "surge_force", "yaw_moment")
TOLERANCE = np.array([0.0, *[1e-8] * 12, 1e-8 * 1.2e7, 1e-8 * 6.4e9])
RELATIVE = 1e-9


def record_of(name: str) -> Record:
    """Run a scenario offline: its rows and its metrics."""
    run = simulate(load_scenario(name))
    return {"scenario": name, "figures": metrics(run), "columns": list(COLUMNS), "rows": rows(run).tolist()}


def rows(run: Run) -> Array:
    """State, reference and wrench at the recorded times, up to the end of the run, (m, 15)."""
    table = np.column_stack((run.time, run.state, run.reference, run.wrench))
    wanted = [t for t in TIMES if t <= run.time[-1] + 1e-9]
    return table[np.searchsorted(run.time, np.array(wanted) - 1e-9)]


def metrics(run: Run) -> dict[str, float | None]:
    """The metrics that the paper and its errata quote, named with their units; None for a time that does not exist."""
    distance, angle = position_error(run.state, run.reference), np.degrees(heading_error(run.state, run.reference))
    first_second, second_cycle = run.time <= 1.0, run.time >= 126.0
    found = {
        **evaluate(run.time, run.state, run.reference, run.wrench)._asdict(),
        "position_error_min": float(distance.min()),
        "position_error_at_50_s": float(distance[np.searchsorted(run.time, 50.0 - 1e-9)]),
        "heading_error_below_1_deg_from": settled(run.time, angle, 1.0),
        "heading_error_rms_from_126_s_deg": rms(angle[second_cycle]),
        "surge_force_peak_of_first_second": float(np.max(np.abs(run.wrench[first_second, 0]))),
        "yaw_moment_peak_of_first_second": float(np.max(np.abs(run.wrench[first_second, 1]))),
    }
    return {name: value for name, value in found.items() if value is None or np.isfinite(value)}


def settled(time: Array, values: Array, limit: float) -> float | None:
    """The time from which a value stays within its limit; None if it does not."""
    outside = np.flatnonzero(np.abs(values) >= limit)
    if not len(outside):
        return float(time[0])
    return float(time[outside[-1] + 1]) if outside[-1] + 1 < len(time) else None


def deviations(recorded: ArrayLike, now: Array) -> Array:
    """The largest deviation of each column from the golden run, relative to its tolerance, (15,)."""
    recorded = np.asarray(recorded)[: len(now)]
    difference = np.abs(now - recorded)
    turned = 2.0 * np.pi - difference[:, [3, 9]]  # headings of pi and -pi are equal
    difference[:, [3, 9]] = np.minimum(difference[:, [3, 9]], turned)
    allowed = TOLERANCE + RELATIVE * np.abs(recorded) + 1e-300
    return np.max(difference / allowed, axis=0)


def changed_metrics(recorded: Metrics, now: Metrics) -> list[tuple[str, float | None, float | None]]:
    """Names and both values of the metrics that differ by more than 1e-6 or are missing in one of the two."""
    names = [*recorded, *(name for name in now if name not in recorded)]
    return [(name, recorded.get(name), now.get(name)) for name in names if differs(recorded.get(name), now.get(name))]


def differs(old: float | None, new: float | None) -> bool:
    """Whether two values of a metric differ by more than 1e-6."""
    if old is None or new is None:
        return old is not new
    return abs(new - old) > 1e-6 * abs(old) + 1e-8


def load(name: str) -> Record:
    """Read a golden run; an empty record if there is none."""
    path = FOLDER / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def save(record: Record) -> None:
    """Write a golden run with one row per line, so that a diff shows the changed rows."""
    head = json.dumps({key: record[key] for key in ("scenario", "figures", "columns")}, indent=1)
    lines = ",\n  ".join(json.dumps(row) for row in record["rows"])
    text = head.removesuffix("\n}") + f',\n "rows": [\n  {lines}\n ]\n}}\n'
    (FOLDER / f"{record['scenario']}.json").write_text(text, encoding="utf-8")
