"""The loops of a law about a straight path: one whose margins are known, and real laws at and beyond their margins."""

import math
from typing import Any, NamedTuple

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.control.interface.law import NO_NETWORKS, KernelLaw
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.loop.control_period import ORIGIN, START
from vessel_hsmc_ros.control.loop.linearised_law import LinearShip, LoopState, System, _loop, loops, margins

PERIOD, U, K = 0.05, 2.0, 0.5
SHIP = LinearShip(
    U, 32.0, np.zeros((3, 3)), np.array([[1.0 / 120e3, 0.0], [0.0, 0.0], [0.0, 1.0 / 636e5]]), (0.0, 0.0), (0.0, 0.0)
)
DAMPED = SHIP._replace(slopes=np.array([[-0.3, 0.0, 0.0], [0.0, -0.8, -1.3], [0.0, 0.0, -0.15]]))
INSTANT: dict[str, Any] = {f"{axis}_{what}": 0.0 for axis in ("surge", "yaw") for what in ("lag", "dead_time")}
RATES: dict[str, Any] = {"surge_force_rate": math.inf, "yaw_moment_rate": math.inf}


class Memory(NamedTuple):
    W: Any


class Proportional(KernelLaw[Any]):
    """A force against the surge velocity relative to the reference, without anything else."""

    name, constants, memory = "proportional", None, Memory(NO_NETWORKS)

    def __init__(self) -> None:
        pass

    @staticmethod
    def kernel(motion, desired, _acceleration, memory, _constants):
        return (-K * 120e3 * (motion.u - desired.u), 0.0), (), memory


def test_a_proportional_loop_has_its_known_margins() -> None:
    # u' = u + T·tau/m with tau = -K·m·u: the pole of the closed loop is 1 - K·T, so the gain may grow until K·T = 2.
    found = margins(loops(Proportional(), ORIGIN, SHIP, PERIOD)["surge force"], PERIOD)
    assert found.gain_db == pytest.approx(20.0 * math.log10(2.0 / (K * PERIOD)), abs=0.1)
    assert found.crossover == pytest.approx(K, rel=0.01)
    assert found.phase_deg == pytest.approx(90.0, abs=1.0)


@pytest.mark.parametrize(("lag", "dead_time"), [(1.0, 0.0), (0.0, 0.15), (0.0, 0.35)])
def test_lag_and_dead_time_of_the_ship_take_their_phase(lag: float, dead_time: float) -> None:
    slow = SHIP._replace(lags=(lag, 0.0), dead_times=(dead_time, 0.0))
    found = margins(loops(Proportional(), ORIGIN, slow, PERIOD)["surge force"], PERIOD)
    w = found.crossover
    assert found.phase_deg == pytest.approx(90.0 - math.degrees(math.atan(w * lag) + w * (dead_time + 0.5 * PERIOD)), abs=0.5)


def controller_of(law: str) -> Any:
    made: Any = make_controller(law, PERIOD, **INSTANT, **RATES)
    made.retune(type(made.parameters)(actuator_identification=False))
    return made


LATE = DAMPED._replace(dead_times=(0.3, 0.3))


@pytest.fixture(scope="module")
def late_loops() -> dict[str, System]:
    """The loops of the guided law, whose memory must be left as it is."""
    law = controller_of("guided")
    before = [np.copy(each) for each in law.memory if isinstance(each, np.ndarray)]
    found = loops(law, ORIGIN, LATE, PERIOD)
    for old, now in zip(before, (each for each in law.memory if isinstance(each, np.ndarray)), strict=True):
        np.testing.assert_array_equal(old, now)
    return found


@pytest.mark.parametrize(("name", "channel"), rest_long([("surge force", 0), ("yaw moment", 1)]))
def test_a_law_is_stable_up_to_its_gain_margin_and_not_beyond(late_loops: dict[str, System], name: str, channel: int) -> None:
    tolerated = 10.0 ** (margins(late_loops[name], PERIOD).gain_db / 20.0)

    def deviation(factor: float) -> float:
        gains = LATE.gains * np.where(np.arange(2) == channel, factor, 1.0)
        advance = _loop(controller_of("guided"), ORIGIN, LATE._replace(gains=gains), PERIOD)
        at = LoopState(
            np.array([0.01, 0.01, 1e-3, 0.0, 0.0, 0.0, 0.0, 0.0]), ((0.0,) * 6, (0.0,) * 6), START, controller_of("guided").memory
        )
        sizes = []
        for k in range(2400):  # near its margin the oscillation decays slowly
            at, _ = advance(k, at)
            sizes.append(max(abs(at.ship[3]), 32.0 * abs(at.ship[5])))
        return max(sizes[-100:]) / max(sizes[:100])

    assert deviation(0.9 * tolerated) < 0.3
    assert deviation(1.15 * tolerated) > 0.6  # its limits bound the oscillation


@pytest.mark.long
def test_a_loop_that_is_unstable_is_found_so() -> None:
    late = DAMPED._replace(dead_times=(0.0, 3.0))
    law = controller_of("guided")
    assert not margins(loops(law, ORIGIN, late, PERIOD)["yaw moment"], PERIOD).stable
