"""Why a controller must not be enabled although its inputs are good: another ship's data, or too far away."""

import math
from collections.abc import Collection

import numpy as np

from vessel_hsmc_ros.core.fence import Fence, allowed, clearance
from vessel_hsmc_ros.core.hull import another_ship, kept
from vessel_hsmc_ros.core.kinematics import Motion

LENGTHS = 100.0  # distance of a reference that no one means, in lengths of the vessel, where no parameter sets it


def hull_problem(vessel: object, given: Collection[str]) -> str:
    """Why a vessel is not that of whoever started the controller; empty if it may be.

    `given`: the dotted names of all parameters that the controller was given.
    """
    papers = {name: text for name, text in kept(vessel).items() if f"vessel.{name}" not in given}
    if another_ship(vessel):
        remaining = ", ".join(f"vessel.{text}" for text in papers.values())
        return f"only a part of the hull is given, of the paper's ship remain {remaining}: give these too" if papers else ""
    if papers and not any(f"vessel.{name}" in given for name in kept(type(vessel)())):
        return (
            "no parameter describes the vessel: give its hull data, as a file of `vessel-hsmc init` has them, or"
            " vessel:=paper_ship for the default ship"
        )
    return ""


def fence_problem(own: Motion, fence: Fence | None) -> str:
    """Why a vessel that is outside of its fence is not to be steered; empty if it is inside, or there is no fence."""
    place = complex(own.x, own.y)
    if fence is None or allowed(fence, place):
        return ""
    outside = -clearance(fence, np.array([place, place]))
    return f"the vessel at ({own.x:.6g}, {own.y:.6g}) m is {outside:.1f} m outside of safety.fence: steer it inside by hand"


def distance_problem(own: Motion, reference: Motion, length: float, limit: float) -> str:
    """Why a reference is not meant for a vessel where it is; empty if it may be.

    `own`: measured motion. `length`: of the vessel, m. `limit`: largest distance, m; negative for LENGTHS.
    """
    largest = LENGTHS * length if limit < 0.0 else limit
    distance = math.hypot(reference.x - own.x, reference.y - own.y)
    if distance <= largest:
        return ""
    return (
        f"the reference at ({reference.x:.6g}, {reference.y:.6g}) m is {distance:.6g} m from the vessel at"
        f" ({own.x:.6g}, {own.y:.6g}) m, and must be within safety.enable_distance = {largest:g} m: are both in one frame?"
    )
