"""Manoeuvres without feedback from which a hull can be identified, scaled to the ship by its units in `ship_rules`."""

import json
from collections.abc import Sequence
from string import Template
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.scenario.ship_rules import Scale

RATES, SAMPLES = (5.0, 10.0, 20.0, 50.0), 30.0
"""Rates of the messages, Hz; the first one is taken that gives this many samples in T."""

SHORTEST = 0.5  # shortest unit of time, s: people and actuators cannot step an input faster
SPEEDS = (0.3, 0.6, 1.0)  # surge forces of the speed steps as shares of F
ZIGZAG_SPEEDS = (0.4, 0.9)

SPIRAL = (1.0, 0.6, 0.3, -0.3, -0.6, -1.0)  # yaw moments of the spiral as shares of N


class Step(NamedTuple):
    """Inputs that are held for a time."""

    manoeuvre: str  # the manoeuvre to which the step belongs
    # surge, yaw: surge force and yaw moment as shares of F and N
    surge: float
    yaw: float
    duration: float  # s


def excitation(scale: Scale) -> list[Step]:
    """The manoeuvres for a ship, one after the other; the last one is a stop."""
    tau_u = max(scale.m11 * scale.U / scale.F, SHORTEST)
    tau_r = max(scale.T, 2.0 * scale.L / scale.U, SHORTEST)
    steps = [Step("speed steps", share, 0.0, 2.5 * tau_u) for share in SPEEDS]
    steps += [Step("coasting", 0.0, 0.0, 2.0 * tau_u), Step("astern", -0.5, 0.0, 2.0 * tau_u)]
    for share in ZIGZAG_SPEEDS:
        steps += [Step("zig-zag", share, 0.0, 1.5 * tau_u), *_zigzag(share, 0.5, 2.0 * tau_r), *_zigzag(share, 1.0, tau_r)]
    steps += [Step("spiral", 0.6, share, 4.0 * tau_r) for share in SPIRAL]
    steps += [Step("coasting", 0.0, 0.0, 2.0 * tau_u)]
    steps += [Step("turns on the spot", 0.0, share, 3.0 * tau_r) for share in (0.5, -0.5, 1.0, -1.0)]
    return [*(step._replace(duration=_rounded(step.duration)) for step in steps), Step("stop", 0.0, 0.0, _rounded(2.0 * tau_r))]


def _zigzag(surge: float, yaw: float, half: float) -> list[Step]:
    """Two periods of alternating yaw moment; the first and the last half period are halved, so that the course stays."""
    parts, whole = (0.5, 1.0, 1.0, 1.0, 0.5), float(max(round(half), 1))
    return [Step("zig-zag", surge, yaw if i % 2 == 0 else -yaw, part * whole) for i, part in enumerate(parts)]


def _rounded(duration: float) -> float:
    """A duration of half seconds."""
    return max(round(2.0 * duration), 1) / 2.0


def starts(steps: Sequence[Step]) -> list[float]:
    """The times at which the steps begin, s, and the end."""
    times = [0.0]
    for step in steps:
        times.append(times[-1] + step.duration)
    return times


def scenario_text(name: str, about: str, vessel: str, scale: Scale, steps: Sequence[Step]) -> str:
    """Write the scenario that commands the manoeuvres."""
    times = starts(steps)
    path = share_directory() / "config" / "templates" / "excite.yaml"
    return Template(path.read_text(encoding="utf-8")).substitute(
        name=name,
        about=about,
        vessel=vessel,
        manoeuvres="\n".join(f"# {times[a]:g} to {times[b]:g} s: {steps[a].manoeuvre}" for a, b in manoeuvres(steps)),
        rate=next((rate for rate in RATES if rate * scale.T >= SAMPLES), RATES[-1]),
        duration=times[-1],
        times=json.dumps(times[:-1]),
        surge_force=json.dumps([_significant(step.surge * scale.F) for step in steps]),
        yaw_moment=json.dumps([_significant(step.yaw * scale.N) for step in steps]),
        position_noise=_significant(0.01 * scale.L),
        heading_noise=0.003,
        velocity_noise=_significant(0.01 * scale.U),
        yaw_rate_noise=_significant(0.01 * scale.r_max),
    )


def manoeuvres(steps: Sequence[Step]) -> list[tuple[int, int]]:
    """The manoeuvres as ranges of steps that belong together: the first one, and the one after the last."""
    bounds = [i for i in range(len(steps)) if i == 0 or steps[i].manoeuvre != steps[i - 1].manoeuvre]
    return list(zip(bounds, [*bounds[1:], len(steps)], strict=True))


def _significant(value: float) -> float:
    """A value with four digits."""
    return float(f"{value:.4g}")


HEAD = ["manoeuvre", "time", "surge force", "yaw moment", "speed", "yaw rate"]


def table(steps: Sequence[Step], run: Run) -> list[list[str]]:
    """A row for each manoeuvre: its inputs, and what the present data predict; the columns are those of HEAD."""
    times, rows = starts(steps), []
    for first, last in manoeuvres(steps):
        inside = (run.time >= times[first]) & (run.time < times[last])
        u, v, r = run.state[inside, 3:].T
        surge, yaw = [step.surge for step in steps[first:last]], [step.yaw for step in steps[first:last]]
        motion = f"{np.hypot(u, v).max():.2f} m/s", f"{np.degrees(abs(r).max()):.1f}°/s"
        rows.append([steps[first].manoeuvre, f"{times[first]:g} to {times[last]:g} s", _range(surge), _range(yaw), *motion])
    return rows


def _range(shares: Sequence[float]) -> str:
    low, high = (100.0 * end for end in (min(shares), max(shares)))
    return f"{low:.0f} %" if low == high else f"±{high:.0f} %" if low == -high else f"{low:.0f} to {high:.0f} %"


def space(run: Run) -> str:
    """How long the manoeuvres take, and how much water."""
    x, y = np.ptp(run.state[:, :2], axis=0)
    minutes = run.time[-1] / 60.0
    return (
        f"they take {minutes:.1f} min and, with the present data, {quantity(float(x), 'm')} by {quantity(float(y), 'm')} of water"
    )
