"""Hull data that no ship can have are rejected with the values or speeds at which they fail."""

from typing import Any

import pytest
from hulls import CYBERSHIP_2, MILLIAMPERE, ship

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import another_ship, kept
from vessel_hsmc_ros.plant.hull_parameters import (
    AXES,
    ShipParameters,
    VesselParameters,
    check_hull,
    hull_warning,
    largest_gain,
    outside,
)
from vessel_hsmc_ros.plant.simulator import PlantParameters, Simulator
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.scenario.warnings import check_scenario

FITTED: dict[str, Any] = {
    "surge_damping": 0.6555,
    "surge_damping_quadratic": -3.0,
    "surge_damping_cubic": 0.1,
    "surge_inertia": 16.8,
}


def reason(**values: Any) -> str:
    """The error line of hull data that differ from the paper's ship's."""
    with pytest.raises(ParameterError) as raised:
        check_hull(ShipParameters(**values))
    return str(raised.value)


def test_the_ship_of_the_paper_is_passive_and_not_coupled() -> None:
    check_hull(ShipParameters())
    assert hull_warning(ShipParameters()) == ""
    assert not VesselParameters().coefficients().coupled


def test_an_inertia_matrix_without_positive_determinant_is_rejected() -> None:
    with pytest.raises(
        ParameterError, match=r"sway_yaw_inertia·yaw_sway_inertia must be less than .* = 1\.13144e\+13 .*got 4e\+06·"
    ):
        VesselParameters(sway_yaw_inertia=4e6).coefficients()
    VesselParameters(sway_yaw_inertia=4e6, yaw_sway_inertia=-1e6).coefficients()


def test_a_yaw_sway_inertia_of_zero_stands_for_a_symmetric_matrix() -> None:
    vessel = VesselParameters(sway_yaw_inertia=-5e5).coefficients()
    assert (vessel.m32, vessel.m_c, vessel.coupled) == (-5e5, -5e5, True)


def test_negative_damping_along_an_axis_is_rejected_with_the_speed_at_which_it_begins() -> None:
    # 0.6555 - 3·u + 0.1·u² = 0 at u = 0.220 m/s
    assert reason(**FITTED) == (
        "vessel_sim.vessel.surge_damping with its quadratic and cubic terms adds energy from u = 0.22 m/s on:"
        " make them non-negative, or declare the speeds for which they hold as surge_speed_range"
    )


def test_a_negative_coefficient_is_admitted_where_the_declared_speeds_end_before_it_outweighs_the_others() -> None:
    check_hull(ShipParameters(**FITTED, surge_speed_range=(-0.1, 0.2)))
    assert "u = 0.22 m/s" in reason(**FITTED, surge_speed_range=(-0.1, 0.3))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("axis", "name"), [(axis, name) for axis, name, _, _ in AXES])
def test_the_damping_of_each_axis_is_checked_up_to_the_faster_end_of_its_range(axis: str, name: str, side: float) -> None:
    fitted = {f"{axis}_damping": 0.6555, f"{axis}_damping_quadratic": -3.0, f"{axis}_damping_cubic": 0.1}

    def hull(fast: float) -> ShipParameters:
        return ShipParameters(**fitted, **{name: tuple(sorted((-0.1 * side, fast * side)))})  # type: ignore[arg-type]

    check_hull(hull(0.2))
    with pytest.raises(ParameterError, match=rf"{axis}_damping with its quadratic and cubic terms adds energy from . = 0\.22 "):
        check_hull(hull(0.3))


def test_a_range_of_speeds_contains_zero() -> None:
    assert "yaw_rate_range must contain 0 and other speeds (got [0.1, 0.2])" in reason(yaw_rate_range=(0.1, 0.2))


def test_cross_terms_that_add_energy_at_ever_larger_speeds_are_rejected() -> None:
    assert "add energy without bound, as at u = " in reason(sway_damping_at_yaw=-1e9)


def test_cross_terms_that_add_energy_at_some_speeds_are_a_warning_that_names_them() -> None:
    """CyberShip II: (d_y_r + d_n_v)² > 4·d_v·d_r, so slow motions in sway and yaw together gain energy."""
    hull = ship(**CYBERSHIP_2)
    check_hull(hull)
    gain = largest_gain(hull)
    assert gain is not None
    assert gain.v * gain.r < 0.0
    assert f"the damping of vessel adds energy at {gain}" in hull_warning(hull)
    slow = {"sway_speed_range": (-0.5, 0.5), "yaw_rate_range": (-0.5, 0.5)}
    assert hull_warning(ship(**CYBERSHIP_2, **slow))


def test_milliampere_is_passive_at_all_speeds() -> None:
    assert largest_gain(ship(**MILLIAMPERE)) is None


def test_a_scenario_and_a_simulator_check_their_hull() -> None:
    with pytest.raises(ParameterError, match="surge_damping with its quadratic"):
        load_scenario("case2_tracking", {"vessel_sim.vessel.surge_damping_quadratic": -1e6})
    with pytest.raises(ParameterError, match="surge_damping with its quadratic"):
        Simulator(PlantParameters(vessel=ShipParameters(surge_damping_quadratic=-1e6)), 0.1)


def test_a_scenario_whose_damping_adds_energy_gives_a_warning() -> None:
    found = check_scenario(load_scenario("case2_tracking", {"vessel_sim.vessel.sway_damping_from_yaw": 1e7}))
    assert any("adds energy" in line for line in found)


def test_coefficients_that_the_papers_ship_does_not_have_are_not_kept_from_it() -> None:
    assert not another_ship(ShipParameters(sway_damping_from_yaw=1e3))
    assert "sway_damping_from_yaw" not in kept(ShipParameters())


def test_speeds_outside_of_their_range_are_named() -> None:
    hull = ShipParameters(sway_speed_range=(-0.5, 0.5))
    assert outside(hull, (9.0, 0.4, 9.0)) == ""
    assert outside(hull, (0.0, -0.6, 0.0)) == "a sway velocity of -0.6 m/s, where the hull data hold from -0.5 to 0.5 m/s"
    unlike = ShipParameters(surge_speed_range=(-0.2, 1.0), sway_speed_range=(-0.3, 0.4), yaw_rate_range=(-0.5, 0.6))
    ends = [getattr(unlike, name) for _, name, _, _ in AXES]
    for i, (low, high) in enumerate(ends):
        for value in (1.01 * low, 1.01 * high):
            found = outside(unlike, [value if k == i else 0.0 for k in range(3)])
            assert found.startswith(f"a {AXES[i][0]} {'rate' if i == 2 else 'velocity'} of {value:.3g} ")
            assert found.endswith(f" from {low:g} to {high:g} {AXES[i][3]}")
    assert outside(unlike, [low for low, _ in ends]) == outside(unlike, [high for _, high in ends]) == ""
