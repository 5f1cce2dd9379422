"""The paper's law with the exact model of the ship: the limit of networks that have converged.

No node may know the plant, so this law exists offline only, to separate the errors of the networks from those of the surfaces.
"""

import math

import numpy as np

from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.laws.hierarchical import control
from vessel_hsmc_ros.laws.hierarchical_parameters import HierarchicalParameters, gains
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.law import Law
from vessel_hsmc_ros.laws.network import Estimates
from vessel_hsmc_ros.laws.terms import Terms
from vessel_sim_node.plant import Vessel, unforced_acceleration


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
        self._gains = gains(parameters, self.vessel, self.period)

    def reset(self) -> None:
        """There is no state to reset."""

    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> tuple[tuple[float, float], Terms]:
        """The wrench (22), (28) with exact network outputs; see `Law.step`."""
        f = Estimates(*unforced_acceleration(motion.u, motion.v, motion.r, self._ship))
        wrench, terms = control(motion, desired, acceleration, f, self._gains)
        # Each network is one neuron, constantly active, with the true value as its weight.
        Wu, Wv, Wr = np.array(f).reshape(3, 1)
        return wrench, Terms(**terms._asdict(), surge_weights=Wu, sway_weights=Wv, yaw_weights=Wr)
