"""What identification takes and gives: measurements, the parameters to estimate, as a vector and as models, and the result."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.schema import suggestion
from vessel_hsmc_ros.plant.dynamics import Vessel, VesselParameters


class Measurements(NamedTuple):
    """One recorded run, sampled at increasing times; `measurements` reads it from runs, bags and CSV files."""

    time: Array  # (n,), s
    pose: Array  # x, y and heading, continuous over full turns, (n, 3)
    velocity: Array  # u, v, r in the body frame, over ground, (n, 3); NaN where they are not measured
    # surge force X [N], sway force Y [N] and yaw moment N [N·m] on the hull, each from its sample to the next, (n, 3)
    wrench: Array
    name: str = "run"  # what to call the run in messages and on pages
    doubts: tuple[str, ...] = ()  # sentences about what in it may be wrong


@dataclass(frozen=True)
class Model:
    """Which numbers are estimated; all others keep their start values."""

    name: str  # `paper`, `coupled`, `linear` or `own`
    parameters: tuple[str, ...]  # names of hull parameters, as in a vessel's file
    # what is estimated beside the hull: `surge_force_gain`, `sway_force_gain`, `yaw_moment_gain` (factors on the recorded
    # wrench), `force_x`, `force_y` (a steady force in the earth frame, N) and `yaw_moment_offset` (N·m)
    inputs: tuple[str, ...] = ()


class Prediction(NamedTuple):
    """Errors of predictions over windows, each started at the smoothed state of its first sample."""

    window: float  # length of a window, s
    starts: Array  # time at which each window starts, (w,), s
    position: Array  # root mean square position error of each window, (w,), m
    heading: Array  # the same of the heading, (w,)
    velocity: Array  # the same of u, v and r, (w, 3), m/s, m/s, rad/s
    simulated: Array  # the predicted x, y, psi, u, v, r of each sample, (n, 6); NaN outside the windows
    measured: Array  # the same from the measurements, (n, 6); smoothed velocities where they are not measured
    time: Array  # (n,), s

    def rms(self) -> dict[str, float]:
        """Root mean square errors over all windows: `position`, `heading`, `surge`, `sway` and `yaw_rate`."""
        means = [np.sqrt(np.mean(np.square(errors))) for errors in (self.position, self.heading, *self.velocity.T)]
        return dict(zip(("position", "heading", "surge", "sway", "yaw_rate"), map(float, means), strict=True))


class Current(NamedTuple):
    """A steady current over ground."""

    # x, y: its components, m/s
    x: float
    y: float
    error: float  # standard error of its speed, m/s; NaN where the run shows none, and it is zero


@dataclass(frozen=True)
class Identified:
    """The result of an identification."""

    model: Model  # what was to be estimated
    values: Mapping[str, float]  # every hull parameter by its name: estimated, or held
    inputs: Mapping[str, float]  # the estimated input gains and offsets by their names
    standard_errors: Mapping[str, float]  # of the estimated parameters and inputs, in the order of `correlation`
    correlation: Array  # of their errors, (p, p)
    # names of parameters that the runs do not determine, each with the reason; they are held
    unidentifiable: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]  # sentences about the rest: strong correlations, bounds that were reached
    residuals: tuple[Array, ...]  # for each run, measured minus simulated x, y, psi, u, v, r, (n, 6); NaN where not measured
    noise: Array  # standard deviation of the residuals by column, (6,)
    predictions: tuple[Prediction, ...]  # errors on the data used, one a run
    # smallest and largest u, v, r in the data, (3, 2): where the result is valid
    ranges: Array = field(default_factory=lambda: np.zeros((3, 2)))
    currents: tuple[Current, ...] = ()  # steady current of each run used

    @property
    def parameters(self) -> dict[str, float]:
        """The estimated parameters and inputs, without those that are held."""
        return {name: {**self.values, **self.inputs}[name] for name in self.standard_errors}

    def vessel_values(self) -> dict[str, float | list[float]]:
        """The hull data for a vessel's file, with the speed ranges of the data; parameters that are zero are left out."""
        hull: dict[str, float | list[float]] = {name: value for name, value in self.values.items() if value != 0.0}
        ranges = zip(("surge_speed_range", "sway_speed_range", "yaw_rate_range"), self.ranges.tolist(), strict=True)
        return hull | dict(ranges)


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

    `names`: `paper`, `linear`, `coupled`, or names of hull parameters. `inputs`: names of input gains and offsets, GAINS and
    OFFSETS. Raises ParameterError if a name is unknown.
    """
    given = MODELS.get(names) if isinstance(names, str) else tuple(names)
    if given is None:
        raise ParameterError(f"{names} is not a model: {suggestion(str(names), MODELS)}")
    for known, chosen in (((*COUPLED, *OTHERS), given), ((*GAINS, *OFFSETS), inputs)):
        for name in chosen:
            if name not in known:
                raise ParameterError(f"{name} cannot be estimated: {suggestion(name, known)}")
    return Model(names if isinstance(names, str) else "own", tuple(given), tuple(inputs))


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
NOT_NEGATIVE = PAPER[3:]  # the damping of each velocity by itself: with these, and without others, the ship never gains energy
NEUTRAL = dict.fromkeys(GAINS, 1.0) | dict.fromkeys((*OFFSETS, DELAY), 0.0)


@dataclass(frozen=True)
class Unknowns:
    """The free numbers of an identification, in order, and the values of all the others."""

    names: tuple[str, ...]  # of the free numbers
    # values of all hull parameters and inputs; those of free numbers are not used
    fixed: Mapping[str, float] = field(default_factory=dict)
    earliest: float = 0.0  # by how much the wrench may act before it is recorded, s

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

    Raises ParameterError if the inertia matrix has no positive determinant.
    """
    hull: dict[str, Any] = {name: float(values.get(name, 0.0)) for name in HULL}
    return VesselParameters(**hull).coefficients()


def inputs(values: Mapping[str, float]) -> tuple[Array, Array, float]:
    """Gains of surge force, sway force and yaw moment, (3,), offsets of earth-fixed forces and yaw moment, (3,), and delay."""
    chosen: Sequence[Sequence[str]] = (GAINS, OFFSETS)
    gains, offsets = (np.array([float(values.get(name, NEUTRAL[name])) for name in names]) for names in chosen)
    return gains, offsets, float(values.get(DELAY, 0.0))


def current_names(runs: int) -> tuple[str, ...]:
    """Names of the components of the current of each run, which are estimated with the hull."""
    return tuple(f"current_{axis}_{number}" for number in range(1, runs + 1) for axis in "xy")


def currents(values: Mapping[str, float], runs: int) -> Array:
    """The steady current of each run along x and y, over ground, (runs, 2), m/s; zero where it is not among the values."""
    return np.array([float(values.get(name, 0.0)) for name in current_names(runs)]).reshape(runs, 2)
