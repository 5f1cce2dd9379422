import math

import numpy as np
import pytest

from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference
from vessel_hsmc_ros.guidance.programs import (
    CourseReference,
    CourseReferenceParameters,
    RampParameters,
    ReferenceShip,
    SineParameters,
)

SINE = SineParameters(math.radians(20.0), 0.05)


def course(period=0.01, **parameters):
    return CourseReference(CourseReferenceParameters(**parameters), (3.0, 4.0), period)


def advanced(reference, steps):
    for _ in range(steps):
        reference.advance()
    return reference


def test_the_mode_selects_the_reference() -> None:
    assert isinstance(make_reference(ReferenceShipParameters(), 0.01), ReferenceShip)
    followed = make_reference(ReferenceShipParameters(mode="course", initial_pose=(3.0, 4.0, 9.0)), 0.01)
    np.testing.assert_array_equal(followed.state, [3.0, 4.0, 0.0, 0.0, 0.0, 0.0])


def test_a_course_reference_has_the_given_heading_with_its_derivatives() -> None:
    reference = advanced(course(heading=0.1, heading_sine=SINE), 1000)
    assert reference.state[2] == pytest.approx(0.1 + math.radians(20.0) * math.sin(0.5))
    before, now, after = (advanced(course(heading_sine=SINE), k).state[[2, 5]] for k in (999, 1000, 1001))
    assert now[1] == pytest.approx((after[0] - before[0]) / 0.02, abs=1e-8)
    assert reference.acceleration() == pytest.approx([0.0, 0.0, (after[1] - before[1]) / 0.02], abs=1e-8)


def test_the_position_of_a_course_reference_moves_along_the_heading() -> None:
    turning = RampParameters((0.0, 2.0 * math.pi), (0.0, 2.0 * math.pi))  # once round, at 1 rad/s
    reference = course(2.0 * math.pi / 628, heading_ramp=turning, surge_velocity=5.0)
    advanced(reference, 314)
    assert reference.state[:3] == pytest.approx([3.0, 14.0, math.pi], abs=1e-3)
    advanced(reference, 314)
    assert reference.state[:2] == pytest.approx([3.0, 4.0], abs=1e-3)
    reference.reset()
    np.testing.assert_array_equal(reference.state, [3.0, 4.0, 0.0, 5.0, 0.0, 1.0])
