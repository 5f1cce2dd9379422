"""The law against its independent double on random states, references, weights, gains and neurons: 1e-9 relative."""

import math
from typing import Any

import numpy as np
import pytest
from independent_law import IndependentLaw

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core.schema import entries, symbols

PERIOD = 0.01
SYMBOLS = {
    entry.symbol: name
    for cls in (KnownVessel, HierarchicalPrintedParameters)
    for name, entry in entries(cls).items()
    if entry.symbol and "." not in name
}


# Every choice of the package, and what it is called in the double.
CHOICES = {
    "saturation": ({"switching": "saturation"}, {"switching": "saturation"}),
    "tanh": ({"switching": "tanh"}, {"switching": "tanh"}),
    "printed neurons": ({"network.basis": "as_printed"}, {"power": 1}),
    "printed adaptation": ({"adaptation": "as_printed"}, {"printed_rates": True}),
    "a switches": ({"sway_weight_sign": "switched"}, {"a_switched": True}),
    "all at once": (
        {"switching": "tanh", "network.basis": "as_printed", "adaptation": "as_printed", "sway_weight_sign": "switched"},
        {"switching": "tanh", "power": 1, "printed_rates": True, "a_switched": True},
    ),
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
    layers = random.uniform(0.5, 500.0, 2)
    settings = {"yaw_boundary_layer": layers[0], "surge_boundary_layer": layers[1], **settings}
    network = {"center": random.uniform(-1.0, 1.0), "spacing": random.uniform(0.1, 1.0), "centers_per_axis": 2}
    width = random.uniform(0.3, 5.0)
    weights = random.normal(size=(3, 8))
    named = {SYMBOLS[symbol]: value for symbol, value in gains.items()}
    shape = {f"network.{name}": value for name, value in {**network, "width": width}.items()}
    law: Any = make_controller("hierarchical_printed", PERIOD, **{**named, **shape, **settings})
    law.memory.W[:] = weights[[2, 0, 1]]  # the double has the order W1, W2, W3
    wrench, _ = law.update(0.0, *motion)
    _, terms = law.update(PERIOD, *motion)
    rates = (np.array([terms.sway_weights, terms.yaw_weights, terms.surge_weights]) - weights) / PERIOD

    centers = grid(network["center"], network["spacing"], 2)
    double = IndependentLaw({**gains, "delta": width}, centers, layers, **options)
    expected, expected_rates = double.update(*motion, *weights)
    assert wrench == pytest.approx([float(tau) for tau in expected], rel=1e-9)
    steps = [PERIOD * float(rate) for row in expected_rates for rate in row]
    assert (PERIOD * rates).ravel() == pytest.approx(steps, rel=1e-9, abs=1e-15)  # a rate is seen through one Euler step


@pytest.mark.parametrize("seed", range(200))
def test_wrench_and_weight_rates_agree(seed: int) -> None:
    random = np.random.default_rng(seed)
    compare(random, random_motion(random), {}, {})


@pytest.mark.parametrize("seed", range(10))
def test_law_and_double_agree_at_z1_zero_where_the_printed_law_is_singular(seed: int) -> None:
    random = np.random.default_rng(seed)
    state, reference, acceleration = random_motion(random)
    state[[0, 2]] = 0.0
    compare(random, (state, reference, acceleration), {}, {})


@pytest.mark.parametrize("seed", range(10))
def test_law_and_double_agree_for_headings_across_180_degrees(seed: int) -> None:
    random = np.random.default_rng(seed)
    state, reference, acceleration = random_motion(random)
    state[2], reference[2] = math.pi - 0.1, -math.pi + 0.1
    compare(random, (state, reference, acceleration), {}, {})


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("seed", range(15))
def test_law_and_double_agree_for_every_interpretation(seed: int, choice: str) -> None:
    random = np.random.default_rng(seed)
    compare(random, random_motion(random), *CHOICES[choice])


@pytest.mark.parametrize("seed", range(5))
def test_listed_neurons_agree(seed: int) -> None:
    random = np.random.default_rng(seed)
    motion, listed, weights = random_motion(random), random.uniform(-1.0, 1.0, (4, 3)), random.normal(size=(3, 4))
    named = {"network.layout": "listed", "network.listed_centers": list(listed.ravel()), "network.width": 0.8}
    law: Any = make_controller("hierarchical_printed", PERIOD, **named)
    law.memory.W[:] = weights[[2, 0, 1]]
    gains = {**symbols(HierarchicalPrintedParameters()), **symbols(KnownVessel()), "delta": 0.8}
    expected, _ = IndependentLaw(gains, listed).update(*motion, *weights)
    assert law.update(0.0, *motion)[0] == pytest.approx([float(tau) for tau in expected], rel=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_the_course_law_is_the_same_law_with_the_heading_surface_alone(seed: int) -> None:
    """a = 0, b = 1, at the origin, where surge does not enter the adaptation of the yaw network."""
    random = np.random.default_rng(seed)
    state, reference, acceleration = random_motion(random)
    state[:2] = 0.0
    weights = random.normal(size=8)
    law: Any = make_controller("course", PERIOD, **{"network.centers_per_axis": 2, "switching_gain": 0.1, "adaptation_gain": 0.5})
    law.memory.W[:] = weights
    (_, tau_2), _ = law.update(0.0, state, reference, acceleration)
    _, after = law.update(PERIOD, state, reference, acceleration)

    gains = {**symbols(HierarchicalPrintedParameters()), **symbols(KnownVessel()), "delta": 5.0, "eta1": 0.1, "gamma2": 0.5}
    double = IndependentLaw({**gains, "a": 0.0, "b": 1.0}, grid(0.5, 0.5, 2))
    (_, expected), rates = double.update(state, reference, acceleration, [0.0] * 8, weights, [0.0] * 8)
    assert tau_2 == pytest.approx(float(expected), rel=1e-9)
    assert after.yaw_weights - weights == pytest.approx([PERIOD * float(rate) for rate in rates[1]], rel=1e-9, abs=1e-15)
