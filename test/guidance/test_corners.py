"""Corners to either side are mirror images, whatever their angle."""

import cmath
import math

import pytest

from vessel_hsmc_ros.guidance.corners import corner_of
from vessel_hsmc_ros.guidance.route import displacement
from vessel_hsmc_ros.guidance.waypoints import OVER, THROUGH


@pytest.mark.parametrize("kind", [THROUGH, OVER])
@pytest.mark.parametrize("degrees", [0.0, 1.0, 20.0, 90.0, 140.0, 170.0, 179.9])
def test_a_corner_to_starboard_is_the_mirror_image_of_one_to_port(kind: str, degrees: float) -> None:
    port, starboard = (corner_of(kind, math.radians(side * degrees), 12.0, 5.0) for side in (1.0, -1.0))
    assert starboard[1:] == pytest.approx(port[1:])
    assert len(starboard.pieces) == len(port.pieces)
    for one, other in zip(starboard.pieces, port.pieces, strict=True):
        assert (one.length, -one.begin, -one.end) == pytest.approx((other.length, other.begin, other.end))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("kind", [THROUGH, OVER])
@pytest.mark.parametrize("degrees", [20.0, 90.0, 170.0])
def test_a_corner_leads_from_the_one_leg_onto_the_other(kind: str, degrees: float, side: float) -> None:
    angle = math.radians(side * degrees)
    corner = corner_of(kind, angle, 12.0, 5.0)
    turned = sum(0.5 * piece.length * (piece.begin + piece.end) for piece in corner.pieces)
    assert turned == pytest.approx(angle)
    waypoint = complex(corner[1], 0.0)
    end = (displacement(corner.pieces) - waypoint) * cmath.exp(-1j * angle)
    assert (end.real, end.imag) == pytest.approx((corner[2], 0.0), abs=1e-6)
