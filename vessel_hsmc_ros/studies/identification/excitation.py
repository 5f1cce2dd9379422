"""Manoeuvres worth sailing for an identification: inputs over time, scaled to a ship.

Each parameter needs motion in which its term of the model is large, and different from the other terms:

| manoeuvre | what it excites |
|---|---|
| speed steps, coasting, astern | surge inertia and damping: several steady speeds separate the linear, quadratic and cubic term |
| zig-zags at two speeds | yaw inertia, and with the drift angle the sway inertia, sway damping and the coupling of sway and yaw |
| spiral | yaw and sway damping at steady yaw rates, with their quadratic and cross terms |
| turns on the spot | yaw damping and coupling without surge speed, so without the Munk moment |

The units of the durations: tau_u = m11·U/F, in which the full surge force reaches the top speed, and tau_r, the longer one of T
and the time in which the ship travels two lengths at top speed, in which drift angle and yaw rate become steady.
"""

import json
from collections.abc import Sequence
from string import Template
from typing import NamedTuple

from vessel_hsmc_ros.core.install_paths import share_directory
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
        manoeuvres="\n".join(f"# {line}" for line in _listed(steps)),
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


def _listed(steps: Sequence[Step]) -> list[str]:
    """The manoeuvres with their times."""
    times = starts(steps)
    return [f"{times[first]:g} to {times[last]:g} s: {steps[first].manoeuvre}" for first, last in manoeuvres(steps)]


def manoeuvres(steps: Sequence[Step]) -> list[tuple[int, int]]:
    """The manoeuvres as ranges of steps that belong together: the first one, and the one after the last."""
    bounds = [i for i in range(len(steps)) if i == 0 or steps[i].manoeuvre != steps[i - 1].manoeuvre]
    return list(zip(bounds, [*bounds[1:], len(steps)], strict=True))


def _significant(value: float) -> float:
    """A value with four digits."""
    return float(f"{value:.4g}")
