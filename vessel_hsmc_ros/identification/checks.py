"""Checks measurements before they are used."""

from collections.abc import Collection, Sequence

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.identification.types import Measurements

FEWEST = 50
"""Samples that a run needs at least."""
LONGEST_GAP = 5.0
"""Largest interval between samples, in units of the median one."""

OTHERWISE = 0.25
"""A force has reversed when it has come from this share of its range at one end to that at the other one."""
EXCITED_BY = {
    "surge_inertia": (0, "surge force", 2, "sail speed steps with coasting or astern in between"),
    "sway_inertia": (2, "yaw moment", 4, "sail zig-zags to both sides, at two speeds"),
    "yaw_inertia": (2, "yaw moment", 4, "sail zig-zags to both sides"),
}
"""The column of the wrench behind each inertia, its name, how many reversals separate the inertia from damping and from the
timing of the wrench, and what to sail."""


def checked(run: Measurements, window: float = 0.0) -> Measurements:
    """The run itself, if it can be used.

    Args:
        run: What was measured.
        window: Its shortest duration, s.

    Raises:
        IdentificationError: too few samples, times that do not increase, gaps, or numbers that are not finite.
    """
    if len(run.time) < FEWEST:
        raise IdentificationError(f"{run.name} has {len(run.time)} samples: at least {FEWEST} are needed")
    for name, values in (("time", run.time), ("pose", run.pose), ("wrench", run.wrench)):
        bad = np.flatnonzero(~np.isfinite(values).reshape(len(run.time), -1).all(axis=1))
        if len(bad):
            raise IdentificationError(f"{run.name}: the {name} of sample {bad[0]} is not finite: remove or fill such samples")
    steps = np.diff(run.time)
    if (steps <= 0.0).any():
        at = int(np.argmax(steps <= 0.0))
        raise IdentificationError(f"{run.name}: time goes from {run.time[at]:g} s to {run.time[at + 1]:g} s: it must increase")
    if steps.max() > LONGEST_GAP * np.median(steps):
        at = int(np.argmax(steps))
        raise IdentificationError(
            f"{run.name}: no sample for {steps[at]:.3g} s at t = {run.time[at]:g} s, but every {np.median(steps):.3g} s "
            "elsewhere: split the run there"
        )
    duration = float(run.time[-1] - run.time[0])
    if duration < window:
        raise IdentificationError(f"{run.name} lasts {duration:.1f} s: at least one window of {window:g} s is needed")
    if not np.any(run.wrench):
        raise IdentificationError(f"{run.name} has no force or moment: the wrench on the hull must be recorded")
    return run


def reversals(force: Array) -> int:
    """How often a force goes from one end of its range to the other, (n,)."""
    low, high = float(force.min()), float(force.max())
    margin = OTHERWISE * (high - low)
    ends = np.select([force >= high - margin, force <= low + margin], [1, -1], 0) if high > low else np.zeros(0)
    return int(np.count_nonzero(np.diff(ends[ends != 0])))


def few_reversals(runs: Sequence[Measurements], names: Collection[str]) -> list[str]:
    """A sentence about each estimated inertia behind which there are too few reversals, and what to sail.

    Args:
        runs: What was measured.
        names: Of the estimated parameters.
    """
    found = []
    for name, (column, force, needed, remedy) in EXCITED_BY.items():
        sway = name == "sway_inertia" and any(np.any(run.wrench[:, 1]) for run in runs)
        column, force = (1, "sway force") if sway else (column, force)
        count = sum(reversals(run.wrench[:, column]) for run in runs)
        if name in names and count < needed:
            times = "1 reversal" if count == 1 else f"{count} reversals"
            found.append(
                f"{name} rests on {times} of the {force}, where {needed} or more are needed: {remedy} (vessel-hsmc excite)"
            )
    return found
