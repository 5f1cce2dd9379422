"""Holds the parameters that the runs do not determine, one after the other, as long as the motion is explained as well.

A parameter that is held changes the estimates of all others. With the derivatives of the residuals, J_o by the others and J_h by
the held one, they move to first order by argmin |J_o·d - J_h·(b - b_held)|, from where they are refined: with strongly correlated
parameters, the motion of any other start is far from the measured one, and a refinement ends in another minimum.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.identification import uncertainty
from vessel_hsmc_ros.identification.refinement import Shooting, refine
from vessel_hsmc_ros.identification.types import Array

ROUGH = 1e-4
"""Tolerance of refinements that are followed by others."""
MOST_RISE = 9.0
"""Largest rise of the sum of squares by a parameter that is held: as of a deviation of three standard errors."""


def reduced(shooting: Shooting, vector: Array, needed: tuple[str, ...]) -> tuple[Shooting, Array, dict[str, str]]:
    """Hold each parameter whose standard error exceeds its value at its start value, or zero: the least certain first.

    Args:
        shooting: The residuals as a function of all parameters.
        vector: Their estimates, (p,).
        needed: Names of those that are never held.

    Returns:
        The residuals as a function of the remaining parameters, their estimates, and the reasons for the others by name.
    """
    found: dict[str, str] = {}
    refused = set(needed)
    while True:
        residuals, jacobian = shooting.residuals(vector), shooting.jacobian(vector)
        matrix = uncertainty.covariance(shooting.cut, residuals, jacobian)
        name, reason = uncertainty.least_known(shooting.unknowns.names, vector, matrix, refused)
        if not name:
            return shooting, vector, found
        smaller, moved = holding(shooting, vector, jacobian, {name: reason})
        index = shooting.unknowns.names.index(name)
        white = uncertainty.inverse(jacobian.reshape(-1, len(vector)))[index, index]
        allowed = np.square(residuals).sum() + MOST_RISE * matrix[index, index] / white
        try:
            moved = refine(smaller, moved, tolerance=ROUGH)
            explained = np.square(smaller.residuals(moved)).sum() <= allowed
        except IdentificationError:  # without this parameter the motion diverges
            explained = False
        if explained:
            shooting, vector = smaller, moved
            found[name] = reason
        else:
            refused.add(name)


def holding(shooting: Shooting, vector: Array, jacobian: Array, held: Mapping[str, str]) -> tuple[Shooting, Array]:
    """The residuals with some parameters held at their start values, or zero, and the estimates of the others, moved along.

    Args:
        shooting, vector: The residuals, and the estimates of their parameters, (p,).
        jacobian: Derivatives of the residuals, (w, k + 1, 6, p).
        held: What is to be held, by name.
    """
    names, fixed = shooting.unknowns.names, shooting.unknowns.fixed
    stays = np.array([name not in held for name in names])
    values = {name: fixed.get(name, 0.0) for name in held}
    change = vector[~stays] - np.array([values[name] for name in names if name in held])
    rows = jacobian.reshape(-1, len(names))
    scale = 1.0 / np.maximum(np.linalg.norm(rows[:, stays], axis=0), 1e-300)
    step = scale * np.linalg.lstsq(rows[:, stays] * scale, rows[:, ~stays] @ change, rcond=1e-9)[0]
    low, high = shooting.unknowns.bounds()
    moved = np.clip(vector[stays] + step, low[stays], high[stays])
    return replace(shooting, unknowns=shooting.unknowns.without(values), scale=shooting.scale[stays]), moved
