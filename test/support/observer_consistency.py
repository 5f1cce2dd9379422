"""Whether the errors of the observer are as large as its covariance states: the normalised estimation error squared (NEES).

With the estimation error e of x, y, psi, u, v, r and their covariance P, eᵀ·P⁻¹·e of a consistent filter has the chi-square
distribution of 6 degrees of freedom: its mean is 6, and that of n independent runs lies within `bounds(n)` in 95 % of all cases.

Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation, section 5.4.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from vessel_hsmc_ros.control.loop.observer import Observer, ObserverConstants, ObserverState, observe
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.compilation import compiled

Stamps = NDArray[np.int64]

DEGREES = 6
"""Degrees of freedom: the components of the motion."""


@kernel
def replay(stamps: Stamps, poses: Array, wrench: Array, s: ObserverState, c: ObserverConstants, x: Array, P: Array) -> None:
    """Run the observer over recorded measurements and write what it estimates.

    Args:
        stamps: Times of the measurements, (n,) ns.
        poses: Measured x, y, psi, (n, 3).
        wrench: Commands given at these times, (n, 2).
        s: State of the observer before them.
        c: Its constants.
        x: For the estimated motions, (n, 6).
        P: For their covariances, (n, 6, 6).
    """
    last = (0.0, 0.0)
    for k in range(len(stamps)):
        s = observe(stamps[k], (poses[k, 0], poses[k, 1], poses[k, 2]), last, s, c)
        last = wrench[k, 0], wrench[k, 1]
        for i in range(6):
            x[k, i] = s.x[i]
            for j in range(6):
                P[k, i, j] = s.P[i, j]


def normalised_errors(run: Run, scenario: Scenario) -> tuple[Array, Array]:
    """The NEES of the scenario's observer at the control periods of a run, (m,), and their times, (m,) s."""
    observer = Observer(scenario.controller.observer, scenario.controller.vessel)
    time, wrench = run.control["time"], np.ascontiguousarray(run.control["commanded"])
    at = np.searchsorted(run.time, time - 1e-9)
    x, P = np.empty((len(at), DEGREES)), np.empty((len(at), DEGREES, DEGREES))
    stamps, poses = np.rint(time * 1e9).astype(np.int64), np.ascontiguousarray(run.measured[at, :3])
    run_it = compiled(replay, "the observer over a run")
    run_it(stamps, poses, wrench, observer.state, observer.constants, x, P)
    error = x - run.state[at]
    error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return np.einsum("ki,kij,kj->k", error, np.linalg.inv(P), error), time


def bounds(runs: int) -> tuple[float, float]:
    """The range that holds the mean NEES over independent runs at one time in 95 % of all cases."""
    low, high = stats.chi2.interval(0.95, DEGREES * runs)
    return float(low) / runs, float(high) / runs
