"""How the compiled loops call the kernel of a law, the error where it is undefined, and its terms over a whole run."""

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.pivot import Carried
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import ControlError, VesselHsmcError
from vessel_hsmc_ros.core.kernel import bound, kernel
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.law.guard import guarded_step, named
from vessel_hsmc_ros.law.kernel_law import FLAGS, KernelLaw
from vessel_hsmc_ros.law.terms import Terms, lyapunov_function, lyapunov_rates, weight_norms

Answer = tuple[tuple[float, float], Any, Any]


@kernel
def step(*_inputs: Any) -> Answer:
    """Stands for the kernel of a law."""
    return (math.nan, math.nan), (), ()


@kernel
def without_age(at: Carried, age: float, memory: Any, constants: Any) -> Answer:  # noqa: ARG001 - in the place of `with_age`
    """The step of a law that takes no age."""
    return step(at.motion, at.desired, at.acceleration, memory, constants)


@kernel
def with_age(at: Carried, age: float, memory: Any, constants: Any) -> Answer:
    """The step of a law that takes the age, s."""
    return step(at.motion, at.desired, at.acceleration, memory, constants, age)


@functools.cache
def law_call(law: type[KernelLaw[Any]]) -> Callable[..., Answer]:
    """The kernel by which a loop calls a law, for the name `law_step`."""
    call = bound(with_age if law.takes_age else without_age, step=law.kernel)
    call.__module__, call.__qualname__ = law.kernel.__module__, law.kernel.__qualname__  # by which its machine code is kept
    return kernel(call)


def is_compilable(law: type[Any]) -> bool:
    """Whether a law is one of the package; the kernels of a user's may not be what they seem."""
    return law.__module__.startswith("vessel_hsmc_ros.")


def cause(law: KernelLaw[Any], at: Carried, age: float) -> VesselHsmcError:
    """The error of a law at a step for which its kernel has no finite wrench: the interpreted law finds its cause.

    Args:
        law: The law, with the memory that the steps before have left.
        at: The inputs of the step.
        age: Age of the measurement, s.
    """
    try:
        guarded_step(law, at.motion, at.desired, at.acceleration, age)
    except VesselHsmcError as error:
        return error
    return ControlError(f"law {named(law)} commanded a wrench that is not finite")


def all_terms(law: KernelLaw[Any], stamps: NDArray[np.int64], grid: RateGrid, terms: Array, weights: Array) -> dict[str, Array]:
    """The terms of every control period, with what follows from them as in `terms.diagnosed`.

    Args:
        law: The law.
        stamps: Times of the control periods, (m,) ns.
        grid: Instants of the control periods.
        terms: Terms of the kernel, (m, t).
        weights: Weights of its networks, (m, k, l).

    Returns:
        All fields of `Terms`, m rows each.
    """
    m = len(stamps)
    given = dict(zip(law.terms._fields, terms.T, strict=True))
    given |= {f"{name}_weights": weights[:, i] for i, name in enumerate(law.networks)}
    found: dict[str, Any] = {}
    for name, default in Terms._field_defaults.items():
        values = given.get(name, np.empty((m, 0)) if name.endswith("_weights") else np.full(m, default))
        found[name] = values != 0.0 if name in FLAGS else np.ascontiguousarray(values)
    for i, norm in enumerate(weight_norms(weights).T):
        found[f"{law.networks[i]}_weight_norm"] = norm
    found["lyapunov"] = lyapunov_function(found["yaw_surface"], found["surge_surface"])
    intervals = np.diff(grid.indices(stamps), prepend=0) * grid.period
    found["lyapunov_rate"] = lyapunov_rates(found["lyapunov"], intervals)
    return found
