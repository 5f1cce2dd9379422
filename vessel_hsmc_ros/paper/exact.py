"""The paper's law with the exact model of the ship: the limit of networks that have converged.

No node may know the plant, so this law exists offline only, to separate the errors of the networks from those of the surfaces.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.laws.hierarchical import control
from vessel_hsmc_ros.laws.hierarchical_parameters import Gains, HierarchicalParameters, gains
from vessel_hsmc_ros.laws.hierarchical_state import StepTerms
from vessel_hsmc_ros.laws.kernel_law import KernelLaw
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.network import Estimates
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration


class ExactConstants(NamedTuple):
    """Gains, and the coefficients of the ship."""

    gains: Gains
    ship: Vessel


class ExactMemory(NamedTuple):
    """The outputs of the networks in the place of weights: each is one neuron, constantly active, shape (3, 1)."""

    W: NDArray[np.float64]


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: ExactMemory, constants: ExactConstants
) -> tuple[tuple[float, float], StepTerms, ExactMemory]:
    """The wrench (22), (28) with exact network outputs; see `KernelLaw`."""
    f_u, f_v, f_r = unforced_acceleration(motion.u, motion.v, motion.r, constants.ship)
    m.W[0, 0], m.W[1, 0], m.W[2, 0] = f_u, f_v, f_r
    wrench, terms = control(motion, desired, acceleration, Estimates(f_u, f_v, f_r), constants.gains)
    return wrench, terms, m


class ExactModelLaw(KernelLaw[HierarchicalParameters]):
    """(16) to (28) with f_u, f_v, f_r of (7) in the place of the networks' outputs.

    Args:
        parameters: Gains of the law; its networks are not used.
        known: The model parameters that the law knows.
        vessel: The plant's coefficients.
    """

    kernel = staticmethod(step)
    terms = StepTerms
    networks = ("surge", "sway", "yaw")

    def __init__(self, parameters: HierarchicalParameters, known: KnownVessel, vessel: Vessel) -> None:
        self._ship = vessel
        super().__init__(parameters, known, math.nan)  # nothing adapts, so there is no period

    def retune(self, parameters: HierarchicalParameters) -> None:
        """Replace the gains."""
        self.constants = ExactConstants(gains(parameters, self.vessel, self.period), self._ship)

    def reset(self) -> None:
        """There is no state to reset."""
        self.memory = ExactMemory(np.zeros((3, 1)))
