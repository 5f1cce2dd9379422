"""Which hull parameters an identification estimates: the paper's model, the linear one, the coupled one, or a list of names."""

from collections.abc import Sequence

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import suggestion
from vessel_hsmc_ros.identification.types import Model

DIAGONAL_INERTIA = ("surge_inertia", "sway_inertia", "yaw_inertia")
LINEAR = ("surge_damping", "sway_damping", "yaw_damping")
PAPER = (*DIAGONAL_INERTIA, *LINEAR, *(f"{name}_{power}" for name in LINEAR for power in ("quadratic", "cubic")))
"""The paper's model (6): diagonal inertia, each velocity damped by itself."""

CROSS_LINEAR = ("sway_damping_from_yaw", "yaw_damping_from_sway")
LINEAR_MODEL = (*DIAGONAL_INERTIA, "sway_yaw_inertia", *LINEAR, *CROSS_LINEAR)
CROSS = (
    "sway_damping_at_yaw",
    "sway_damping_from_yaw_at_sway",
    "sway_damping_from_yaw_quadratic",
    "yaw_damping_from_sway_quadratic",
    "yaw_damping_from_sway_at_yaw",
    "yaw_damping_at_sway",
)
"""Damping that couples sway and yaw."""

COUPLED = (*PAPER, "sway_yaw_inertia", *CROSS_LINEAR, *CROSS)
OTHERS = (
    "surge_damping_from_sway",
    "surge_damping_from_sway_yaw",
    "sway_damping_at_surge",
    "sway_damping_from_yaw_at_surge",
    "yaw_damping_from_sway_at_surge",
    "yaw_damping_at_surge",
)
MODELS = {"paper": PAPER, "linear": LINEAR_MODEL, "coupled": COUPLED}
GAINS = ("surge_force_gain", "sway_force_gain", "yaw_moment_gain")
OFFSETS = ("force_x", "force_y", "yaw_moment_offset")
DELAY = "wrench_delay"
"""By how much the wrench acts later than it is recorded, s: estimated always, as an error of it looks like inertia."""


def model(names: str | Sequence[str], inputs: Sequence[str] = ()) -> Model:
    """The parameters to estimate, by the name of a model or one by one.

    Args:
        names: `paper`, `linear`, `coupled`, or names of hull parameters.
        inputs: Names of input gains and offsets, GAINS and OFFSETS.

    Raises:
        ParameterError: a name is unknown.
    """
    given = MODELS.get(names) if isinstance(names, str) else tuple(names)
    if given is None:
        raise ParameterError(f"{names} is not a model: {suggestion(str(names), MODELS)}")
    for known, chosen in (((*COUPLED, *OTHERS), given), ((*GAINS, *OFFSETS), inputs)):
        for name in chosen:
            if name not in known:
                raise ParameterError(f"{name} cannot be estimated: {suggestion(name, known)}")
    return Model(names if isinstance(names, str) else "own", tuple(given), tuple(inputs))
