"""Checks measurements before they are used."""

import numpy as np

from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.identification.types import Measurements

FEWEST = 50
"""Samples that a run needs at least."""
LONGEST_GAP = 5.0
"""Largest interval between samples, in units of the median one."""


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
