"""The observer over time without samples, and its errors beside its covariance."""

import math

import numpy as np
from observer_consistency import bounds

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import CE, D1, ObserverParameters, propagate
from vessel_hsmc_ros.core.kinematics import wrap

SHIP = KnownVessel(**INSTANT)

STEP = 50_000_000


def coasting(silent: range) -> list[float]:
    """Position errors of a ship at 2 m/s, measured at 20 Hz, while the position sensor repeats one sample."""
    observer = Observer(ObserverParameters(), SHIP)
    random = np.random.default_rng(1)
    errors, position = [], (0.0, 0.0)
    for k in range(1400):
        if k not in silent:
            position = 0.1 * k + 0.5 * random.normal(), 0.5 * random.normal()
        pose = np.array([*position, 0.005 * random.normal()])
        estimate = observer.update(k * STEP, pose, (0.0, 0.0))
        errors.append(math.hypot(estimate.x - 0.1 * k, estimate.y))
    return errors


def test_while_positions_are_missing_the_estimate_continues_by_the_model() -> None:
    silent = range(800, 920)
    errors = coasting(silent)
    assert max(errors[800:920]) < 2.0  # the last sample is 12 m behind after 6 s
    assert max(errors[960:]) < 1.0


def test_a_filter_of_the_true_model_is_consistent_over_many_runs() -> None:
    """The mean of the normalised error squared over 40 ships that drift with damping and current of the filter's own prior."""
    random, nees = np.random.default_rng(2), []
    for _ in range(40):
        observer = Observer(ObserverParameters(), SHIP)
        c = observer.constants
        start = random.normal(size=len(c.start)) * np.sqrt(c.start)
        start[D1:CE] = [*c.decay] + 0.3 * start[D1:CE]
        truth = start.copy()
        for k in range(160):
            pose = truth[:3] + random.normal(size=3) * np.sqrt(c.noise)
            pose[2] = wrap(pose[2])
            observer.update(k * STEP, pose, (1e5, 5e5) if k else (0.0, 0.0))
            if k < 159:
                propagate(truth, 1e5 / c.m11, 5e5 / c.m_p, 0.05, c.model)
                truth += random.normal(size=len(truth)) * np.sqrt(0.05 * np.diag(c.Q))
        error = observer.state.x[:6] - truth[:6]
        error[2] = wrap(error[2])
        nees.append(error @ np.linalg.solve(observer.covariance[:6, :6], error))
    low, high = bounds(40)
    assert low - 1.0 < np.mean(nees) < high + 1.0
