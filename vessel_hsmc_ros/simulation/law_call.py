"""How the compiled loops call the kernel of a law, which takes the age of the measurement or does not."""

import functools
import math
from collections.abc import Callable
from typing import Any

from vessel_hsmc_ros.control.pivot import Carried
from vessel_hsmc_ros.core.kernel import bound, kernel
from vessel_hsmc_ros.laws.kernel_law import KernelLaw

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
