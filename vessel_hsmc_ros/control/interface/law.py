"""The interface of a control law: constructed from its parameters, stepped once per period, retuned while it runs, reset."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.terms import Terms
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_motion
from vessel_hsmc_ros.core.schema import parameter

Parameters = TypeVar("Parameters")


def gain(default: float, description: str, unit: str, symbol: str, low: float = 0.0, high: float = 1e3) -> float:
    """Declare a gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=low, high=high, symbol=symbol, tunable=True)


class Law(ABC, Generic[Parameters]):
    """A control law with its internal state.

    A subclass names itself and its dataclass of parameters, `class MyLaw(Law[MyParameters])` with `name = "my_law"`, and defines
    `step`; a law with an internal state also defines `reset`.

    Args:
        parameters: Gains and all other parameters that the law declares.
        vessel: What the law knows of the ship.
        period: Control period, the time between two steps, s.

    Attributes:
        name: Value of `controller.law` that selects the law, and name of the group of its parameters.
        takes_age: Whether `step` takes the age of the motion as well, because the law predicts the motion over it; a class that
            defines `step` declares it anew.
        takes_heading: Whether `step` takes the measured heading after the age, because the law identifies the actuators: the
            heading of `motion` may be estimated, and then turns as the estimator's own model does.
        tracks: Whether the law tracks the position of the reference; comparisons leave out those that do not.
        keeps_limits: Whether the law commands no more than the limits of the vessel, so that more is an error.
        parameters: The present parameters, unless the law redefines `retune`.
        vessel, period: As constructed.

    Raises:
        ParameterError: a gain is unstable at this period, or a list among the parameters has a wrong length.
    """

    name: ClassVar[str] = ""
    takes_age: ClassVar[bool] = False
    takes_heading: ClassVar[bool] = False
    tracks: ClassVar[bool] = True
    keeps_limits: ClassVar[bool] = True

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        # A variant of a law that takes the age may define a step without it.
        if "step" in vars(cls) and "takes_age" not in vars(cls):
            cls.takes_age = cls.takes_heading = False

    def __init__(self, parameters: Parameters, vessel: KnownVessel, period: float) -> None:
        self.vessel = vessel
        self.period = period
        self.retune(parameters)
        self.reset()

    def retune(self, parameters: Parameters) -> None:
        """Take new gains and keep the internal state; the size of a network or of a horizon stays as constructed.

        Called at construction and for each parameter that changes while the law runs. By default it sets `self.parameters`; a
        law that derives constants from its parameters, or that rejects some combinations, redefines it.

        Raises:
            ParameterError: a gain is unstable at the law's period.
        """
        self.parameters = parameters

    def reset(self) -> None:
        """Return to the initial internal state: zero weights, zero integrals, no estimates; by default there is none."""

    @property
    def known(self) -> KnownVessel:
        """What the law takes the ship for: what is declared, unless it has learned better."""
        return self.vessel

    @property
    def water(self) -> tuple[complex, float, float, float] | None:
        """What the law observes of the water, for the fence; None for a law that does not observe it.

        Current over the earth and the bound of its error, m/s; decay rate of the surge velocity through the water, 1/s; surge
        acceleration by what else acts, m/s².
        """
        return None

    @abstractmethod
    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> tuple[tuple[float, float], Terms]:
        """Compute the wrench for one control period and advance the internal state.

        This is the form that the control loop calls: plain floats in, plain floats out. Of a law with `takes_age` it has a fourth
        argument, `age: float = 0.0`: how long ago the ship was in this state, s. Ship and reference are always of the same time.

        Args:
            motion: State of the ship, finite.
            desired: State of the reference, finite.
            acceleration: Derivatives of the reference's body velocities, finite.

        Returns:
            (tau_1 [N], tau_2 [N·m]) and the intermediate terms of the law.

        Raises:
            ControlError: the law is undefined for this input.
        """

    def update(
        self,
        time: float,
        state: Sequence[float] | Array,
        reference: Sequence[float] | Array,
        reference_acceleration: Sequence[float] | Array,
    ) -> tuple[Array, Terms]:
        """`step` on arrays, for notebooks and independent checks.

        Args:
            time: Time of the state, s. No law depends on it so far; it is part of the interface for time-varying laws.
            state: x, y, psi, u, v, r of the ship, shape (6,), finite.
            reference: The same of the reference, shape (6,), finite.
            reference_acceleration: du_d, dv_d, dr_d, shape (3,), finite.

        Returns:
            tau_1 [N] and tau_2 [N·m], shape (2,), and the intermediate terms of the law.

        Raises:
            ControlError: the law is undefined for this input.
        """
        del time
        wrench, terms = self.step(as_motion(state), as_motion(reference), as_acceleration(reference_acceleration))
        return np.array(wrench), terms
