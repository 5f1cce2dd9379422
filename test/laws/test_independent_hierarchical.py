"""The repaired law against its independent double over drawn histories: 1e-9 relative, with all that it remembers."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from independent_hierarchical import IndependentHierarchical

from vessel_hsmc_ros.law.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.laws.hierarchical_parameters import LASTING, HierarchicalParameters, gains

PERIOD = 0.05


def law_and_double(random: np.random.Generator) -> tuple[Any, IndependentHierarchical]:
    """The law for drawn numbers and a drawn vessel, and the double with the same constants and neurons."""
    vessel = replace(KnownVessel(), **INSTANT, length=float(random.uniform(5.0, 60.0)))
    printed = HierarchicalParameters()
    names = (
        "approach_rate approach_deceleration station_lever lookahead_time yaw_reaching_gain surge_boundary_layer prediction_gain"
    )
    drawn = {name: getattr(printed, name) * float(random.uniform(0.7, 1.4)) for name in names.split()}
    parameters = replace(printed, **drawn, actuator_identification=False)
    law = HierarchicalController(parameters, vessel, PERIOD)
    found = gains(parameters, vessel, PERIOD)._asdict()
    axis = [0.0, 0.5, 1.0]
    return law, IndependentHierarchical(found, [(a, b, c) for a in axis for b in axis for c in axis], 5.0, LASTING)


@pytest.mark.parametrize("seed", range(24))
def test_law_and_double_agree_over_a_history(seed: int) -> None:
    """Twelve periods of unrelated motions, so that every state of the memory enters; both directions of travel."""
    random = np.random.default_rng(seed)
    law, double = law_and_double(random)
    size, forwards = float(10.0 ** random.uniform(-2.0, 0.0)), 1.0 if seed % 3 else -1.0
    for k in range(12):
        desired = random.uniform(-1.0, 1.0, 6) * [100.0, 100.0, math.pi, 0.5, 0.3, 0.2] + [
            0.0,
            0.0,
            0.0,
            1.5 * forwards,
            0.0,
            0.0,
        ]
        state = desired + random.uniform(-1.0, 1.0, 6) * size * [20.0, 20.0, 3.0, 1.0, 0.5, 0.2]
        rates = random.uniform(-1.0, 1.0, 3) * [0.1, 0.05, 0.02]
        wrench, _ = law.update(PERIOD * k, state, desired, rates)
        expected = double.step(state, desired, rates)
        scale = law.constants.gains
        for one, other, limit in zip(wrench, expected, (scale.tau_1max, scale.tau_2max), strict=True):
            assert one == pytest.approx(float(other), rel=1e-9, abs=1e-9 * limit)
    assert law.memory.c == pytest.approx(
        (float(double.current.real), float(double.current.imag), float(double.lasting)), rel=1e-9
    )
    np.testing.assert_allclose(law.memory.W, np.array(double.W, dtype=float), rtol=1e-6, atol=1e-9)
