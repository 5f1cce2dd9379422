"""The interface of a control law: constructed from its parameters, stepped once per period, retuned while it runs, reset.

The intermediate terms of a control law, named in words; they are the fields of ControlState.msg, for every law.

| name | meaning | unit | equation |
|---|---|---|---|
| surge, sway, heading_error | z1e, z2e, z3e | m, m, rad | (11) |
| .._error_rate | their time derivatives | m/s, m/s, rad/s | (23), (12), (17) |
| sway, heading_surface | sigma1, sigma2 | m/s, rad/s | (12), (17) |
| yaw, surge_surface | S1, S2 | rad/s, m/s | (20), (23) |
| commanded_.. | heading, yaw rate and surge velocity that the guidance commands | rad, rad/s, m/s | - |
| .._estimate | network outputs for f_u, f_v, f_r | m/s², m/s², rad/s² | (25), (14), (15) |
| .._weights | their weights W3, W1, W2, shape (l,) | as the outputs | (25), (14), (15) |
| .._weight_norm | Euclidean norm of each weight vector | as the outputs | (30) |
| lyapunov | V_S = (S1² + S2²)/2, the part of V that can be measured | mixed | (30) |
| lyapunov_rate | difference quotient of V_S since the last step | 1/s | (31) |
| .._saturated | whether the law limited the wrench | - | - |

Of a kernel law the step is a pure function, which the nodes interpret and batches of runs compile.

Calls of the code of a law, which may be a user's: whatever it does wrong becomes one line with its file and line number.
"""

import math
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from inspect import getfile
from operator import itemgetter
from typing import Any, ClassVar, Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.network import NetworkParameters
from vessel_hsmc_ros.core.exceptions import ControlError, LawError, VesselHsmcError
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_motion
from vessel_hsmc_ros.core.schema import parameter

Number = TypeVar("Number", float, NDArray[np.float64])

NONE = math.nan
NO_WEIGHTS: Array = np.empty(0)


class Terms(NamedTuple):
    """The terms of one control period; terms that a law does not have keep their default: NaN, empty or false."""

    surge_error: float = NONE
    sway_error: float = NONE
    heading_error: float = NONE
    surge_error_rate: float = NONE
    sway_error_rate: float = NONE
    heading_error_rate: float = NONE
    sway_surface: float = NONE
    heading_surface: float = NONE
    yaw_surface: float = NONE
    surge_surface: float = NONE
    commanded_heading: float = NONE
    commanded_yaw_rate: float = NONE
    commanded_surge_velocity: float = NONE
    surge_estimate: float = NONE
    sway_estimate: float = NONE
    yaw_estimate: float = NONE
    surge_weights: Array = NO_WEIGHTS
    sway_weights: Array = NO_WEIGHTS
    yaw_weights: Array = NO_WEIGHTS
    surge_weight_norm: float = NONE
    sway_weight_norm: float = NONE
    yaw_weight_norm: float = NONE
    lyapunov: float = NONE
    lyapunov_rate: float = NONE
    surge_saturated: bool = False
    yaw_saturated: bool = False


def diagnosed(terms: Terms, previous_lyapunov: float | None, interval: float) -> Terms:
    """Add the quantities that follow from the terms of any law: weight norms, V_S and its rate of change.

    `previous_lyapunov`: V_S at the last step; None at the first step, whose rate is 0. `interval`: time since the last step, s.
    Returns the terms with weight_norm, lyapunov and lyapunov_rate filled in.
    """
    lyapunov = lyapunov_function(terms.yaw_surface, terms.surge_surface)
    rate = 0.0 if previous_lyapunov is None else (lyapunov - previous_lyapunov) / interval
    return terms._replace(
        surge_weight_norm=_norm(terms.surge_weights),
        sway_weight_norm=_norm(terms.sway_weights),
        yaw_weight_norm=_norm(terms.yaw_weights),
        lyapunov=lyapunov,
        lyapunov_rate=rate,
    )


def lyapunov_function(yaw_surface: Number, surge_surface: Number) -> Number:
    """V_S of (30) from S1 and S2, numbers or arrays; NaN for a law without both surfaces."""
    return 0.5 * (yaw_surface * yaw_surface + surge_surface * surge_surface)


def lyapunov_rates(lyapunov: Array, interval: Array) -> Array:
    """The rates of V_S that `diagnosed` gives step by step, for a whole run.

    `lyapunov`: V_S at each control step, shape (m,). `interval`: time since the step before, s, shape (m,); the first value is
    not used. Returns difference quotients, shape (m,); the first is 0.
    """
    rates = np.zeros(len(lyapunov))
    rates[1:] = np.diff(lyapunov) / interval[1:]
    return rates


def weight_norms(weights: Array) -> Array:
    """Euclidean norms over the last axis, bit-identical to those that `diagnosed` gives step by step.

    `weights`: weights, shape (..., l). Returns the norms, shape (...).
    """
    squares = np.zeros(weights.shape[:-1])
    # One after the other, as `_norm` does: np.sum and np.dot add in other orders for other shapes.
    for i in range(weights.shape[-1]):
        squares += weights[..., i] * weights[..., i]
    return np.sqrt(squares)


def _norm(weights: Array) -> float:
    return math.sqrt(np.add.accumulate(weights * weights)[-1]) if len(weights) else NONE


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


KINDS = tuple(type(value) for value in Terms())  # the types of the terms, as the messages require them


def guarded_step(
    law: Law[Any], motion: Motion, desired: Motion, acceleration: Acceleration, age: float = 0.0, heading: float = math.nan
) -> tuple[tuple[float, float], Terms]:
    """Call `step` of a law and check what it returns.

    `age`: how long ago ship and reference were in these states, s, for a law that takes it. `heading`: measured heading, for a
    law that takes it. Returns the wrench and the terms, in plain floats. LawError if the law raised another exception, or
    returned something else than a wrench and terms.
    """
    try:
        aged = (age, heading) if law.takes_heading else (age,) if law.takes_age else ()
        returned = law.step(motion, desired, acceleration, *aged)
    except VesselHsmcError:
        raise
    except (Exception, SystemExit) as error:
        raise LawError(described(law, error)) from error
    try:
        (tau_1, tau_2), terms = returned
        wrench = _number(tau_1), _number(tau_2)
        if not (isinstance(terms, Terms) and all(map(isinstance, terms, KINDS))):
            terms = _plain(terms)
    except (Exception, SystemExit):  # of the value's own code, or a number beyond a float
        raise LawError(
            f"law {named(law)} returned {returned!r:.100}: step returns (surge force, yaw moment), Terms(...)"
        ) from None
    if not (math.isfinite(wrench[0]) and math.isfinite(wrench[1])):
        raise ControlError(f"command of law {named(law)} must be finite numbers (got {wrench[0]} N and {wrench[1]} N·m)")
    return wrench, terms


@contextmanager
def guarded(law: type[Law[Any]] | Law[Any], kind: type[VesselHsmcError] = LawError) -> Iterator[None]:
    """A context for other calls of a law: an exception of its code becomes an error of the given kind."""
    try:
        yield
    except VesselHsmcError:
        raise
    except (Exception, SystemExit) as error:
        raise kind(described(law, error)) from error


def named(law: type[Law[Any]] | Law[Any]) -> str:
    """The name of a law, or of its class if it has none."""
    return law.name or getattr(law, "__name__", type(law).__name__)


def described(law: type[Law[Any]] | Law[Any], error: BaseException) -> str:
    """An exception in the code of a law in one line, with the last place in the law's own file that led to it."""
    frames = traceback.extract_tb(error.__traceback__)
    cls = law if isinstance(law, type) else type(law)
    try:
        file = getfile(cls)
    except (OSError, TypeError):  # a class defined at a prompt has no file
        file = ""
    place = next((frame for frame in reversed(frames) if frame.filename == file), frames[-1])
    message = " ".join(str(error).split())
    return f"law {named(law)} failed at {place.filename}:{place.lineno}: {type(error).__name__}: {message}"


def _number(value: Any) -> float:
    """A number as a plain float; a text such as "1", which float() reads, is none."""
    return float(1.0 * value)


def _plain(terms: Terms) -> Terms:
    """Terms with NumPy's scalars and lists of weights converted. Raises TypeError, ValueError if these are not terms."""
    if not isinstance(terms, Terms):
        raise TypeError
    converters: dict[Any, Any] = {float: _number, bool: bool, np.ndarray: partial(np.asarray, dtype=float)}
    return Terms._make(converters[kind](value) for kind, value in zip(KINDS, terms, strict=True))


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
        """Raise the error that explains a wrench of NaN at a motion of the ship; by default there is no explanation."""

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
