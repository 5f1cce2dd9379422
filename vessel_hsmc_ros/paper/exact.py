"""The paper's law with the exact model of the ship: the limit of networks that have converged.

No node may know the plant, so this law exists offline only, to separate the errors of the networks from those of the surfaces.
"""

import math

import numpy as np

from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.laws.hierarchical import Weights, control
from vessel_hsmc_ros.laws.hierarchical_parameters import HierarchicalParameters, gains
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.law import Law
from vessel_hsmc_ros.laws.terms import Terms
from vessel_sim_node.plant import Vessel, unforced_acceleration

ONE_NEURON = np.ones(1)


class ExactModelLaw(Law[HierarchicalParameters]):
    """(16) to (28) with f_u, f_v, f_r of (7) in the place of the networks' outputs.

    Args:
        parameters: Gains of the law; its networks are not used.
        known: The model parameters that the law knows.
        vessel: The plant's coefficients.
    """

    def __init__(self, parameters: HierarchicalParameters, known: KnownVessel, vessel: Vessel) -> None:
        self._ship = vessel
        super().__init__(parameters, known, math.nan)  # nothing adapts, so there is no period

    def retune(self, parameters: HierarchicalParameters) -> None:
        """Replace the gains."""
        self._gains = gains(parameters, self.vessel)

    def reset(self) -> None:
        """There is no state to reset."""

    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> tuple[tuple[float, float], Terms]:
        """The wrench (22), (28) with exact network outputs; see `Law.step`."""
        # Each network is one neuron, constantly active, with the true value as its weight.
        f_u, f_v, f_r = unforced_acceleration(motion.u, motion.v, motion.r, self._ship)
        weights = Weights(np.array([f_v]), np.array([f_r]), np.array([f_u]))
        return control(motion, desired, acceleration, weights, ONE_NEURON, self._gains)
