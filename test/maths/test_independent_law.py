"""The law against its independent double on random states, references, weights, gains and neurons: 1e-9 relative."""

import math

import numpy as np
import pytest
from independent_law import IndependentLaw

from vessel_hsmc_ros.laws import HierarchicalParameters, KnownVessel, make_controller
from vessel_hsmc_ros.laws.hierarchical import Weights
from vessel_hsmc_ros.schema import entries

PERIOD = 0.01
SYMBOLS = {
    entry.symbol: name
    for cls in (KnownVessel, HierarchicalParameters)
    for name, entry in entries(cls).items()
    if entry.symbol and "." not in name
}


def random_gains(random):
    """By the paper's symbols, over some decades around the printed ones."""
    printed = {"a": 1e-3, "b": 100.0, "c1": 0.3, "c2": 0.3, "c3": 0.3, "k1": 50.0, "k2": 50.0, "eta1": 0.1, "eta2": 0.1}
    ours = {"gamma1": 0.01, "gamma2": 1e-3, "gamma3": 1.0, "m11": 120e3, "m33": 636e5}
    return {name: value * 10.0 ** random.uniform(-0.5, 0.5) for name, value in {**printed, **ours}.items()}


def grid(center, spacing, per_axis):
    """Centres in the order of the package: the last coordinate runs fastest."""
    axis = [center + (i - (per_axis - 1) / 2) * spacing for i in range(per_axis)]
    return [(u, v, r) for u in axis for v in axis for r in axis]


def random_motion(random):
    spread = np.array([200.0, 200.0, math.pi, 3.0, 1.0, 0.5])
    return random.uniform(-spread, spread), random.uniform(-spread, spread), random.uniform(-1.0, 1.0, 3) * [1.0, 0.5, 0.1]


def compare(random, motion, settings, options):
    """One period of both; `settings` are the package's, `options` the double's."""
    gains = random_gains(random)
    network = {"center": random.uniform(-1.0, 1.0), "spacing": random.uniform(0.1, 1.0), "centers_per_axis": 2}
    width = random.uniform(0.3, 5.0)
    weights = random.normal(size=(3, 8))
    named = {SYMBOLS[symbol]: value for symbol, value in gains.items()}
    shape = {f"network.{name}": value for name, value in {**network, "width": width}.items()}
    law = make_controller("hierarchical", PERIOD, **{**named, **shape, **settings})
    law.weights = Weights(*weights)
    wrench, _ = law.update(0.0, *motion)
    rates = (np.array(law.weights) - weights) / PERIOD

    centers = grid(network["center"], network["spacing"], 2)
    double = IndependentLaw({**gains, "delta": width}, centers, **options)
    expected, expected_rates = double.update(*motion, *weights)
    assert wrench == pytest.approx([float(tau) for tau in expected], rel=1e-9)
    steps = [PERIOD * float(rate) for row in expected_rates for rate in row]
    assert (PERIOD * rates).ravel() == pytest.approx(steps, rel=1e-9, abs=1e-15)  # a rate is seen through one Euler step


@pytest.mark.parametrize("seed", range(200))
def test_wrench_and_weight_rates_agree(seed):
    random = np.random.default_rng(seed)
    compare(random, random_motion(random), {}, {})


@pytest.mark.parametrize("seed", range(10))
def test_at_z1_zero_where_the_printed_law_has_no_value(seed):
    random = np.random.default_rng(seed)
    state, reference, acceleration = random_motion(random)
    state[[0, 2]] = 0.0
    compare(random, (state, reference, acceleration), {}, {})


@pytest.mark.parametrize("seed", range(10))
def test_across_the_seam_of_the_heading(seed):
    random = np.random.default_rng(seed)
    state, reference, acceleration = random_motion(random)
    state[2], reference[2] = math.pi - 0.1, -math.pi + 0.1
    compare(random, (state, reference, acceleration), {}, {})
