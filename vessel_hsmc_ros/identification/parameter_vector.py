"""The numbers that are estimated, as a vector: their names, values, bounds, and the ship and inputs that they stand for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.identification.types import DELAY, GAINS, OFFSETS, PAPER, Model
from vessel_hsmc_ros.plant.dynamics import Vessel, VesselParameters

HULL = (
    "surge_inertia",
    "sway_inertia",
    "yaw_inertia",
    "sway_yaw_inertia",
    "yaw_sway_inertia",
    "surge_damping",
    "surge_damping_quadratic",
    "surge_damping_cubic",
    "surge_damping_from_sway",
    "surge_damping_from_sway_yaw",
    "sway_damping",
    "sway_damping_quadratic",
    "sway_damping_cubic",
    "sway_damping_at_yaw",
    "sway_damping_at_surge",
    "sway_damping_from_yaw",
    "sway_damping_from_yaw_quadratic",
    "sway_damping_from_yaw_at_sway",
    "sway_damping_from_yaw_at_surge",
    "yaw_damping",
    "yaw_damping_quadratic",
    "yaw_damping_cubic",
    "yaw_damping_at_sway",
    "yaw_damping_at_surge",
    "yaw_damping_from_sway",
    "yaw_damping_from_sway_quadratic",
    "yaw_damping_from_sway_at_yaw",
    "yaw_damping_from_sway_at_surge",
)
"""All hull parameters of the equations of motion."""

POSITIVE = ("surge_inertia", "sway_inertia", "yaw_inertia")
NOT_NEGATIVE = PAPER[3:]
"""The damping of each velocity by itself: with these, and without others, the ship never gains energy."""
NEUTRAL = dict.fromkeys(GAINS, 1.0) | dict.fromkeys((*OFFSETS, DELAY), 0.0)


@dataclass(frozen=True)
class Unknowns:
    """The free numbers of an identification, in order, and the values of all the others.

    Attributes:
        names: Of the free numbers.
        fixed: Values of all hull parameters and inputs; those of free numbers are not used.
        earliest: By how much the wrench may act before it is recorded, s.
    """

    names: tuple[str, ...]
    fixed: Mapping[str, float] = field(default_factory=dict)
    earliest: float = 0.0

    def values(self, vector: Array) -> dict[str, float]:
        """All numbers by their names."""
        return {**NEUTRAL, **dict.fromkeys(HULL, 0.0), **self.fixed, **dict(zip(self.names, map(float, vector), strict=True))}

    def without(self, held: Mapping[str, float]) -> "Unknowns":
        """The unknowns with some of them held at values."""
        return replace(self, names=tuple(name for name in self.names if name not in held), fixed={**self.fixed, **held})

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds: inertia and gains are positive, the damping of a velocity by itself is not negative."""
        low = [0.0 if name in (*POSITIVE, *NOT_NEGATIVE, *GAINS) else -np.inf for name in self.names]
        delay = np.array(self.names) == DELAY
        return np.where(delay, -self.earliest, low), np.where(delay, 0.0, np.inf)


def unknowns(model: Model, start: VesselParameters | None) -> Unknowns:
    """The unknowns of a model; all other hull parameters as in a ship, or zero."""
    fixed = {} if start is None else {name: float(getattr(start, name)) for name in HULL}
    if "sway_yaw_inertia" in model.parameters:
        fixed["yaw_sway_inertia"] = 0.0  # the estimate is symmetric
    return Unknowns((*model.parameters, *model.inputs), fixed)


def vessel(values: Mapping[str, float]) -> Vessel:
    """The plant's coefficients; hull parameters that are missing are zero.

    Raises:
        ParameterError: the inertia matrix has no positive determinant.
    """
    hull: dict[str, Any] = {name: float(values.get(name, 0.0)) for name in HULL}
    return VesselParameters(**hull).coefficients()


def inputs(values: Mapping[str, float]) -> tuple[Array, Array, float]:
    """Gains of surge force, sway force and yaw moment, (3,), offsets of earth-fixed forces and yaw moment, (3,), and delay."""
    chosen: Sequence[Sequence[str]] = (GAINS, OFFSETS)
    gains, offsets = (np.array([float(values.get(name, NEUTRAL[name])) for name in names]) for names in chosen)
    return gains, offsets, float(values.get(DELAY, 0.0))
