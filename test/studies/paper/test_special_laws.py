"""The variants of the repaired law: with the exact model of the ship, and with other constants."""

from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.control.laws.hierarchical_parameters import HierarchicalParameters
from vessel_hsmc_ros.core.kinematics import as_acceleration, as_motion
from vessel_hsmc_ros.plant.dynamics import unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.studies.paper.cases import NO_NETWORKS
from vessel_hsmc_ros.studies.paper.reproduction import AlteredLaw, ExactRepairedLaw

SHIP = VesselParameters().coefficients()
NUMBERS = HierarchicalParameters(), KnownVessel(**INSTANT), 0.01


def drawn_states(count: int) -> Any:
    rng = np.random.default_rng(5)
    scale = (20.0, 20.0, 3.0, 2.0, 0.5, 0.1)
    for _ in range(count):
        state, desired = rng.uniform(-1.0, 1.0, 6) * scale, rng.uniform(-1.0, 1.0, 6) * scale
        yield as_motion(state), as_motion(desired), as_acceleration(rng.uniform(-0.05, 0.05, 3))


def test_the_law_with_the_exact_model_is_the_law_whose_networks_give_it() -> None:
    exact = ExactRepairedLaw(*NUMBERS, SHIP)
    for motion, desired, acceleration in drawn_states(30):
        law = HierarchicalController(*NUMBERS)
        f = unforced_acceleration(motion.u, motion.v, motion.r, SHIP)
        law.step(motion, desired, acceleration)  # gives the activations at this motion
        law.memory.growth[:] = 0.0
        law.memory.W[:] = np.array(f)[:, None] / law.memory.H.sum()
        law.memory = law.memory._replace(c=(0.0, 0.0, 0.0), predicted=motion)  # as if the motion had been predicted exactly
        wrench, terms = law.step(motion, desired, acceleration)
        found, exact_terms = exact.step(motion, desired, acceleration)
        assert found == pytest.approx(wrench, rel=1e-9)
        for name in ("sway_error", "yaw_surface", "surge_surface", "sway_surface", "yaw_estimate", "sway_estimate"):
            assert getattr(exact_terms, name) == pytest.approx(getattr(terms, name), rel=1e-9, abs=1e-12), name


def test_a_law_with_adaptation_gains_of_zero_learns_nothing() -> None:
    law = AlteredLaw(*NUMBERS, NO_NETWORKS)
    for motion, desired, acceleration in drawn_states(10):
        law.step(motion, desired, acceleration)
    assert not law.memory.W.any()
    learning = AlteredLaw(*NUMBERS, {})
    for motion, desired, acceleration in drawn_states(10):
        learning.step(motion, desired, acceleration)
    assert learning.memory.W.all()


def test_other_constants_outlast_a_change_of_parameters_and_a_reset() -> None:
    law = AlteredLaw(*NUMBERS, {"l0": 7.0})
    law.retune(HierarchicalParameters(approach_rate=2.0))
    assert law.constants.gains.l0 == 7.0
    law.reset()
    assert law.constants.gains.l0 == 7.0
    assert law.constants.gains.c == pytest.approx(
        HierarchicalController(HierarchicalParameters(approach_rate=2.0), *NUMBERS[1:]).constants.gains.c
    )
