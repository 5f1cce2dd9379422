"""The repaired law against its independent double over drawn histories: 1e-9 relative, with all that it remembers."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from durations import rest_long
from independent_hierarchical import IndependentHierarchical

from vessel_hsmc_ros.control.interface.actuators import dynamics
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.control.laws.hierarchical_parameters import LASTING, HierarchicalParameters, gains
from vessel_hsmc_ros.core.kinematics import as_acceleration, as_motion

PERIOD = 0.05


def drawn_actuators(random: np.random.Generator) -> dict[str, Any]:
    """Declared lag, dead time and rate of both inputs; the dead times up to more than twelve periods."""
    found = {}
    for name, rate, limit in (("surge", "force_rate", "force_limit"), ("yaw", "moment_rate", "moment_limit")):
        found[f"{name}_lag"] = float(random.choice([0.0, random.uniform(0.02, 3.0)]))
        found[f"{name}_dead_time"] = float(random.choice([0.0, random.uniform(0.0, 6.0 * PERIOD), random.uniform(0.0, 1.0)]))
        full = float(random.choice([0.0, random.uniform(0.2, 10.0)]))
        found[f"{name}_{rate}"] = getattr(KnownVessel(), f"{name}_{limit}") / full if full else math.inf
    return found


def law_and_double(random: np.random.Generator, actuators: dict[str, Any]) -> tuple[Any, IndependentHierarchical]:
    """The law for drawn numbers and a drawn vessel, and the double with the same constants and neurons."""
    vessel = replace(KnownVessel(), **actuators, length=float(random.uniform(5.0, 60.0)))
    printed = HierarchicalParameters()
    names = (
        "approach_rate approach_deceleration station_lever lookahead_time yaw_reaching_gain surge_boundary_layer prediction_gain"
    )
    drawn = {name: getattr(printed, name) * float(random.uniform(0.7, 1.4)) for name in names.split()}
    parameters = replace(printed, **drawn, actuator_identification=False)
    law = HierarchicalController(parameters, vessel, PERIOD)
    found = {name: value for name, value in gains(parameters, vessel, PERIOD)._asdict().items() if isinstance(value, float)}
    inputs = [(each.lag, each.remaining, each.rate, each.dead_time) for each in dynamics(vessel)[:2]]
    axis = [0.0, 0.5, 1.0]
    return law, IndependentHierarchical(found, inputs, [(a, b, c) for a in axis for b in axis for c in axis], 5.0, LASTING)


@pytest.mark.parametrize("declared", rest_long([False, True]), ids=["instant", "actuators"])
@pytest.mark.parametrize("seed", rest_long(range(24)))
def test_law_and_double_agree_over_a_history(seed: int, declared: bool) -> None:
    """Periods of unrelated motions, so that every state of the memory enters; both directions of travel, late measurements."""
    random = np.random.default_rng(seed)
    law, double = law_and_double(random, drawn_actuators(random) if declared else INSTANT)
    size, forwards = float(10.0 ** random.uniform(-2.0, 0.0)), 1.0 if seed % 3 else -1.0
    late, scale = int(random.integers(0, 5)) if declared else 0, law.constants.gains
    for _ in range(20 if declared else 12):
        desired = random.uniform(-1.0, 1.0, 6) * [100.0, 100.0, math.pi, 0.5, 0.3, 0.2] + 1.5 * forwards * np.eye(6)[3]
        state = desired + random.uniform(-1.0, 1.0, 6) * size * [20.0, 20.0, 3.0, 1.0, 0.5, 0.2]
        rates = random.uniform(-1.0, 1.0, 3) * [0.1, 0.05, 0.02]
        wrench, _ = law.step(as_motion(state), as_motion(desired), as_acceleration(rates), late * PERIOD)
        expected = double.step(state, desired, rates, late)
        for one, other, limit in zip(wrench, expected, (scale.tau_1max, scale.tau_2max), strict=True):
            assert one == pytest.approx(float(other), rel=1e-9, abs=1e-9 * limit)
    assert law.memory.c == pytest.approx(
        (float(double.current.real), float(double.current.imag), float(double.lasting)), rel=1e-9
    )
    np.testing.assert_allclose(law.memory.W, np.array(double.W, dtype=float), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(law.memory.predicted, np.array(double.predicted, dtype=float), rtol=1e-9, atol=1e-9)
