import pytest

from vessel_hsmc_ros.guided.rule import INTEGRAL_SHARE, POSITION_BOUND, RULES, SURFACE_BOUND, derived_gains, unit_time
from vessel_hsmc_ros.law.known_vessel import KnownVessel

BOUNDED = {"position_gain", "heading_surface_slope", "integral_gain", "sway_share", "sway_bandwidth", "forecast_bandwidth"}


def test_a_hull_with_low_sway_damping_gets_slower_guidance_and_nothing_else() -> None:
    free, bound = derived_gains(KnownVessel()), derived_gains(KnownVessel(sway_damping_rate=0.02))
    assert {name for name in RULES if bound[name] != free[name]} == BOUNDED
    assert bound["position_gain"] == pytest.approx(POSITION_BOUND * 0.02)
    assert bound["heading_surface_slope"] == pytest.approx(SURFACE_BOUND * 0.02)
    assert bound["integral_gain"] == pytest.approx(INTEGRAL_SHARE * bound["position_gain"] ** 2)
    assert bound["sway_share"] == 0.0


def test_a_sway_velocity_that_decays_at_once_bounds_no_gain_of_the_guidance() -> None:
    free, bound = derived_gains(KnownVessel()), derived_gains(KnownVessel(sway_damping_rate=100.0 / unit_time(KnownVessel())))
    assert {name for name in RULES if bound[name] != free[name]} == {"sway_share", "sway_bandwidth", "forecast_bandwidth"}
