"""Which laws run compiled, and the error of one that has no finite wrench there."""

from typing import Any

from vessel_hsmc_ros.control.pivot import Carried
from vessel_hsmc_ros.core.exceptions import ControlError, VesselHsmcError
from vessel_hsmc_ros.laws.guard import guarded_step, named
from vessel_hsmc_ros.laws.kernel_law import KernelLaw


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
