"""Laws whose step is a kernel: a pure function, which the nodes interpret and batches of runs compile."""

import math
from collections.abc import Callable
from operator import itemgetter
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import Law, Parameters, Terms
from vessel_hsmc_ros.control.interface.network import NetworkParameters
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

NO_NETWORKS = np.empty((0, 0))  # the weights of a law without networks
FLAGS = tuple(name for name, default in Terms._field_defaults.items() if default is False)
"""The terms that are booleans, the last fields of `Terms`; a kernel returns 0.0 or 1.0."""


@kernel
def up_to_date(memory: Any, constants: Any) -> bool:  # noqa: ARG001 - of a law whose constants never change by themselves
    """Whether a law needs other constants: no."""
    return False


class KernelLaw(Law[Parameters]):
    """A law that holds the constants and the memory of a kernel.

    The kernel is a function of the module,

        step(motion, desired, acceleration, memory, constants) -> ((tau_1, tau_2), terms, memory)

    with NamedTuples: `constants`, `memory` and `terms` are of classes that no other law uses, `terms` are floats by the names of
    fields of `Terms`, and `memory.W` holds the weights that this step has used, shape (k, l), a row for each network. Where the
    law is undefined, the kernel returns a wrench of NaN and its memory unchanged. The kernel of a law with `takes_age` has a last
    argument, `age: float = 0.0`, and of one with `takes_heading` another, `heading: float = math.nan`.

    A law that learns what its constants depend on has a kernel `outdated(memory, constants) -> bool`, which is called after every
    step, and a method `renew`, which then sets other constants of the same types, before the next step.

    A subclass defines the class attributes, a `retune` that sets `constants`, and a `reset` that sets `memory`.
    """

    kernel: ClassVar[Callable[..., Any]]  # the function, as a staticmethod
    # whether the constants do not fit the memory any more, as a staticmethod
    outdated: ClassVar[Callable[..., bool]] = staticmethod(up_to_date)
    terms: ClassVar[type[Any]]  # the class of its terms
    networks: ClassVar[tuple[str, ...]] = ()  # what the rows of W approximate: "surge", "sway" or "yaw"
    constants: Any  # gains and all else that does not change from step to step
    memory: Any  # internal state; its arrays are written in place

    _absent: ClassVar[tuple[Any, ...]]
    _in_order: ClassVar[Callable[[tuple[Any, ...]], tuple[Any, ...]]]
    _has_flags: ClassVar[bool]

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "terms" in vars(cls):
            given = (*cls.terms._fields, *(f"{name}_weights" for name in cls.networks))
            absent = [name for name in Terms._fields if name not in given]
            cls._absent = tuple(Terms._field_defaults[name] for name in absent)
            cls._in_order = itemgetter(*map((*given, *absent).index, Terms._fields))
            cls._has_flags = not set(FLAGS).isdisjoint(given)

    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration, *age: float) -> tuple[tuple[float, float], Terms]:
        """Call the kernel and keep its memory; see `Law.step`. Raises ControlError if the law is undefined for this input."""
        wrench, terms, memory = self.kernel(motion, desired, acceleration, self.memory, self.constants, *age)
        if math.isnan(wrench[0]):
            self.explain_undefined(motion)
        self.memory = memory
        found = self.as_terms(terms, memory.W)
        if self.outdated(memory, self.constants):
            self.renew()
        return wrench, found

    def renew(self) -> None:
        """Set constants that fit the memory; called where they are outdated."""

    def explain_undefined(self, motion: Motion) -> None:
        """Raise the error that explains a wrench of NaN at a motion of the ship; by default there is no explanation.

        Raises ControlError if the law is undefined for this motion.
        """

    @classmethod
    def as_terms(cls, terms: tuple[float, ...], W: Any) -> Terms:
        """The terms of the kernel as `Terms`, with a copy of the weights W, shape (k, l)."""
        values = cls._in_order(tuple(terms) + tuple(W.copy()) + cls._absent)
        if cls._has_flags:
            values = *values[: -len(FLAGS)], *map(bool, values[-len(FLAGS) :])
        return Terms._make(values)


class WithNetwork(Protocol):
    """Parameters that declare a network."""

    @property
    def network(self) -> NetworkParameters:
        """The neurons."""
        ...


NetworkLawParameters = TypeVar("NetworkLawParameters", bound=WithNetwork)


class AdaptiveLaw(KernelLaw[NetworkLawParameters]):
    """A kernel law with networks whose neurons are fixed at construction; only their weights change.

    Attributes:
        neurons: The neurons that all networks share.

    Raises:
        ParameterError: a gain is unstable at this period, or the number of listed centres is not a multiple of three.
    """

    def __init__(self, parameters: NetworkLawParameters, vessel: KnownVessel, period: float) -> None:
        # Before super().__init__, whose reset sizes the weights by the neurons.
        self.neurons = parameters.network.neurons()
        super().__init__(parameters, vessel, period)
