"""The linearised loops of the guided law against the law itself, and margins that are known in closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.guided.controller import GuidedController, step
from vessel_hsmc_ros.guided.margins import Actuator, Hull, surge_loop, yaw_loop
from vessel_hsmc_ros.guided.parameters import GuidedParameters, gains
from vessel_hsmc_ros.law.known_vessel import KnownVessel
from vessel_hsmc_ros.law.linear_loop import System, exact_step, margins

T = 0.05
HULL = Hull(2.3, -0.3, 1.0, np.array([[-1.1, -1.5], [0.0, -0.15]]), np.array([0.0, 1.0]))
IDEAL = KnownVessel(
    surge_lag=0.0,
    yaw_lag=0.0,
    surge_force_rate=math.inf,
    yaw_moment_rate=math.inf,
    surge_dead_time=0.0,
    yaw_dead_time=0.0,
)
QUICK = replace(IDEAL, surge_lag=0.1, yaw_lag=0.1)  # lags of a few hundredths of the time of a turn
LATE = replace(IDEAL, surge_dead_time=0.1, yaw_dead_time=0.1)
SLOW = replace(IDEAL, surge_lag=0.7, yaw_lag=0.7, surge_dead_time=0.2, yaw_dead_time=0.3)


def closed(system: System, start: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """The states of the closed loop, shape (count, n)."""
    A = system.A + np.outer(system.B, system.C) / (1.0 - system.D)
    rows = [start]
    for _ in range(count - 1):
        rows.append(A @ rows[-1])
    return np.array(rows)


@pytest.mark.parametrize(
    "vessel", [IDEAL, QUICK, LATE, SLOW, KnownVessel()], ids=["ideal", "quick", "late", "slow", "not declared"]
)
def test_the_linear_yaw_loop_moves_as_the_law_does_on_a_linear_hull(vessel: KnownVessel) -> None:
    actuator = Actuator(max(vessel.yaw_lag, 0.0), max(vessel.yaw_dead_time, 0.0))
    law, start, count = GuidedController(GuidedParameters(), vessel, T), 1e-4, 400
    for at_guidance in (False, True):
        system = yaw_loop(law.constants.gains, HULL, actuator, at_guidance=at_guidance)
        state = np.zeros(len(system.A))
        # y, psi, v, r and a come first, then the law's predictions of the first four, which start as measured.
        state[1] = state[6] = start
        linear = closed(system, state, count)[:, :2]

        A = np.zeros((5, 5))
        A[0], A[1, 3], A[2:4, 2:4] = [0.0, HULL.speed, 1.0, 0.0, 0.0], 1.0, HULL.lateral
        B = np.zeros(5)
        if actuator.lag:
            A[3, 4], A[4, 4], B[4] = 1.0, -1.0 / actuator.lag, 1.0 / actuator.lag
        else:
            B[3] = 1.0
        move, drive = exact_step(A, B, T)
        memory, truth, sent = law.memory, np.array([0.0, start, 0.0, 0.0, 0.0]), [0.0] * round(actuator.dead_time / T)
        memory.W[:], memory.queue[:], memory.slow[:] = 0.0, 0.0, 0.0
        for k in range(count):
            assert truth[:2] == pytest.approx(linear[k], rel=2e-3, abs=2e-2 * start)
            x = HULL.speed * T * k
            ship = Motion(x, truth[0], truth[1], HULL.speed, truth[2], truth[3])
            (_, moment), _, memory = step(
                ship, Motion(x, 0.0, 0.0, HULL.speed, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0), memory, law.constants
            )
            sent.append(moment / vessel.yaw_inertia)
            truth = move @ truth + drive * sent.pop(0)


def test_the_broken_integrator_has_its_known_margins() -> None:
    # x' = x + k·T·u with u = -x: the pole of the closed loop is 1 - k·T, so the gain may grow until k·T = 2.
    k = 0.5
    found = margins(System(np.array([[1.0]]), np.array([k * T]), np.array([-1.0]), 0.0), T)
    assert found.stable
    assert found.gain_db == pytest.approx(20.0 * math.log10(2.0 / (k * T)), abs=0.1)
    assert found.crossover == pytest.approx(k, rel=0.01)
    assert found.phase_deg == pytest.approx(90.0, abs=1.0)
    assert found.delay == pytest.approx(0.5 * math.pi / k, rel=0.02)


@pytest.mark.parametrize("loop", [surge_loop, yaw_loop])
def test_the_loop_is_stable_within_its_gain_margin_and_not_beyond(loop: object) -> None:
    g = gains(GuidedParameters(), SLOW, T)
    system = loop(g, HULL, Actuator(0.7, 0.2 if loop is surge_loop else 0.3))  # type: ignore[operator]
    tolerated = 10.0 ** (margins(system, T).gain_db / 20.0)

    def stable(factor: float) -> bool:
        scaled = System(system.A, factor * system.B, system.C, factor * system.D)
        return margins(scaled, T).stable

    assert stable(0.97 * tolerated)
    assert stable(1.0 / (0.97 * tolerated))
    assert not (stable(1.03 * tolerated) and stable(1.0 / (1.03 * tolerated)))
