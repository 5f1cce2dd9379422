"""What every control law is: made from its parameters, called once a period, retuned while it runs, reset."""

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.terms import Terms

Array = NDArray[np.float64]
Parameters = TypeVar("Parameters")


class Law(ABC, Generic[Parameters]):
    """A control law with its memory.

    Args:
        parameters: Gains, and whatever else the law declares.
        vessel: What is known of the ship.
        period: Time between two updates, s.

    Raises:
        ParameterError: the parameters make no law at this period.
    """

    def __init__(self, parameters: Parameters, vessel: KnownVessel, period: float) -> None:
        self._vessel = vessel
        self._period = period
        self.retune(parameters)
        self.reset()

    @abstractmethod
    def retune(self, parameters: Parameters) -> None:
        """Take other gains and keep what was learnt; a network's or a horizon's shape stays as it was made.

        Raises:
            ParameterError: the parameters make no law at this period.
        """

    @abstractmethod
    def reset(self) -> None:
        """Forget what was learnt."""

    def update(
        self,
        time: float,  # noqa: ARG002 - offered to laws that change with it; none does yet
        state: Array,
        reference: Array,
        reference_acceleration: Array,
    ) -> tuple[Array, Terms]:
        """One period: the wrench to command, and the law's memory moved on.

        Args:
            time: Time of the state, s.
            state: x, y, psi, u, v, r, shape (6,), finite.
            reference: The same of what is followed, shape (6,), finite.
            reference_acceleration: Its du_d, dv_d, dr_d, shape (3,), finite.

        Returns:
            tau_1 [N] and tau_2 [N·m], shape (2,), and the terms that led to them.

        Raises:
            ControlError: the law has no value for this input.
        """
        return self._step(state, reference, reference_acceleration)

    @abstractmethod
    def _step(self, state: Array, reference: Array, reference_acceleration: Array) -> tuple[Array, Terms]:
        """One period, as `update`."""
