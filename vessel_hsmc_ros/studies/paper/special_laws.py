"""Variants of both forms of the law for which no parameters exist: with the exact model, and with other constants."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.kernel_law import KernelLaw
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.network import Estimates
from vessel_hsmc_ros.control.laws import hierarchical as repaired
from vessel_hsmc_ros.control.laws import hierarchical_parameters as repaired_parameters
from vessel_hsmc_ros.control.laws.hierarchical import HierarchicalController, guidance, turn_in_current
from vessel_hsmc_ros.control.laws.hierarchical_parameters import HierarchicalParameters
from vessel_hsmc_ros.control.laws.hierarchical_printed import Gains, HierarchicalPrintedParameters, StepTerms, control, gains
from vessel_hsmc_ros.core.kernel import clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration

repaired_control = repaired.control  # a kernel calls others by their names in its module


class ExactConstants(NamedTuple):
    """Gains, and the coefficients of the ship."""

    gains: Gains
    ship: Vessel


class ExactMemory(NamedTuple):
    """The outputs of the networks, kept as weights: each is one neuron, constantly active, shape (3, 1)."""

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


class ExactModelLaw(KernelLaw[HierarchicalPrintedParameters]):
    """The law as printed, (16) to (28), with f_u, f_v, f_r of (7) instead of the networks' outputs.

    `parameters`: gains of the law; its networks are not used.
    """

    kernel = staticmethod(step)
    terms = StepTerms
    networks = ("surge", "sway", "yaw")

    def __init__(self, parameters: HierarchicalPrintedParameters, known: KnownVessel, vessel: Vessel) -> None:
        self._ship = vessel
        super().__init__(parameters, known, math.nan)  # nothing adapts, so there is no period

    def retune(self, parameters: HierarchicalPrintedParameters) -> None:
        """Replace the gains."""
        self.constants = ExactConstants(gains(parameters, self.vessel, self.period), self._ship)

    def reset(self) -> None:
        """There is no state to reset."""
        self.memory = ExactMemory(np.zeros((3, 1)))


class RepairedConstants(NamedTuple):
    """Gains of the repaired law, and the coefficients of the ship."""

    gains: repaired_parameters.Gains
    ship: Vessel


class RepairedMemory(NamedTuple):
    """The outputs of the networks, as in `ExactMemory`."""

    W: NDArray[np.float64]


class RepairedTerms(NamedTuple):
    """Errors, surfaces and estimates, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    sway_surface: float
    heading_surface: float
    yaw_surface: float
    surge_surface: float
    surge_estimate: float
    sway_estimate: float
    yaw_estimate: float


@kernel
def repaired_step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: RepairedMemory, constants: RepairedConstants
) -> tuple[tuple[float, float], RepairedTerms, RepairedMemory]:
    """The limited wrench of the repaired law with exact network outputs, without a current; see `KernelLaw`."""
    g, still = constants.gains, (0.0, 0.0, 0.0)
    f_u, f_v, f_r = unforced_acceleration(motion.u, motion.v, motion.r, constants.ship)
    m.W[0, 0], m.W[1, 0], m.W[2, 0] = f_u, f_v, f_r
    n, turn = guidance(motion, desired, acceleration, g), turn_in_current(desired, acceleration, still, g)
    s = repaired_control(motion, n, turn, still, desired.u, Estimates(f_u, f_v, f_r), g)
    terms = RepairedTerms(n.e1, n.e2, n.psi_e, s.sigma1, s.sigma2, s.S1, s.S2, f_u, f_v, f_r)
    return (clip(s.tau_1, g.tau_1max), clip(s.tau_2, g.tau_2max)), terms, m


class ExactRepairedLaw(KernelLaw[HierarchicalParameters]):
    """The repaired law with f_u, f_v, f_r of (7) instead of the networks' outputs; the arguments are those of a law.

    `parameters`: numbers of the law; its networks are not used.
    """

    kernel = staticmethod(repaired_step)
    terms = RepairedTerms
    networks = ("surge", "sway", "yaw")

    def __init__(self, parameters: HierarchicalParameters, known: KnownVessel, period: float, vessel: Vessel) -> None:
        self._ship = vessel
        super().__init__(parameters, known, period)

    def retune(self, parameters: HierarchicalParameters) -> None:
        """Replace the gains."""
        self.constants = RepairedConstants(repaired_parameters.gains(parameters, self.vessel, self.period), self._ship)

    def reset(self) -> None:
        """There is no state to reset."""
        self.memory = RepairedMemory(np.zeros((3, 1)))


class AlteredLaw(HierarchicalController):
    """The repaired law with constants that no parameters give, such as adaptation gains of zero.

    `changes`: constants by their symbols in `Gains`, in SI units.
    """

    def __init__(
        self, parameters: HierarchicalParameters, vessel: KnownVessel, period: float, changes: Mapping[str, Any]
    ) -> None:
        self._changes = changes  # before super().__init__, which takes the gains for a model
        super().__init__(parameters, vessel, period)

    def _use(self, model: int) -> None:
        super()._use(model)
        self.constants = self.constants._replace(gains=self.constants.gains._replace(**self._changes))
