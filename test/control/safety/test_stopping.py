"""Where a vessel comes to rest: stops by hand, and drawn ones that are integrated in small steps."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.safety.fence_guard import HEADING, Braking, Stop, Water, braking_distance, mean_delay, stop
from vessel_hsmc_ros.core.kinematics import Motion

INSTANT = Braking(deceleration=0.5, lag=0.0, dead_time=0.0, rate=math.inf, turn_time=10.0, heading_time=1.0, late=0.0)


def at(u: float, v: float = 0.0, r: float = 0.0, psi: float = 0.0) -> Motion:
    return Motion(0.0, 0.0, psi, u, v, r)


def stopped(u: float, acting: float = 0.0, water: Water | None = None, **braking: float) -> Stop:
    return stop(at(u), acting, 0.0, INSTANT._replace(**braking), water or Water())


def test_instant_actuators_stop_in_the_square_of_the_speed_over_twice_the_deceleration() -> None:
    found = stopped(2.0)
    assert (found.distance, found.time, found.delay) == pytest.approx((4.0, 4.0, 0.0))
    assert found.way[-1] == pytest.approx(4.0)
    assert found.radius == pytest.approx(4.0 * HEADING)


@pytest.mark.parametrize(
    ("braking", "acting", "distance"),
    [
        ({"dead_time": 1.5}, 0.0, 3.0 + 4.0),
        ({"late": 0.5, "dead_time": 1.0}, 0.0, 3.0 + 4.0),
        ({"lag": 1.0}, 0.0, 2.0 + 4.0),
        ({"rate": 0.25}, 0.0, 2.0 + 4.0),  # 2 s to the full force: half of it late
        ({"rate": 0.25, "lag": 1.0}, 0.0, 2.0 * 1.25 + 4.0),
        ({"dead_time": 1.0}, 0.5, 2.0 + 0.25 + 2.5**2),  # it accelerates meanwhile
    ],
)
def test_the_force_comes_late_by_the_mean_of_its_delays(braking: dict[str, float], acting: float, distance: float) -> None:
    assert stopped(2.0, acting, None, **braking).distance == pytest.approx(distance)


def test_an_astern_stop_is_the_mirror_of_one_ahead() -> None:
    ahead = stop(at(1.5, 0.1, 0.2, 0.3), 0.2, 0.1, INSTANT, Water(0.2 - 0.1j, 0.02, 0.2, 0.05))
    astern = stop(at(-1.5, 0.1, 0.2, 0.3 + math.pi), -0.2, 0.1, INSTANT, Water(0.2 - 0.1j, 0.02, 0.2, -0.05))
    assert astern.distance == pytest.approx(ahead.distance)
    assert astern.way[1] != pytest.approx(0.0)
    assert astern.time == pytest.approx(ahead.time)


def test_resistance_shortens_a_stop_and_a_following_current_lengthens_it() -> None:
    still, resisting = stopped(2.0), stopped(2.0, water=Water(decay=0.2))
    following, opposing = (stopped(2.0, water=Water(current, 0.0, 0.2)) for current in (0.8 + 0j, -0.8 + 0j))
    assert opposing.distance <= resisting.distance < still.distance
    assert resisting.distance < following.distance
    # g_0 = 0.2·(0.8 - 2), and g = g_0 + 1.25·0.2·2
    assert following.distance == pytest.approx(4.0 / (2.0 * 0.5) * math.log(1.0 + 0.5 / (0.5 - 0.26)))


def test_a_vessel_that_the_current_pushes_as_hard_as_it_can_never_stops() -> None:
    found = stopped(2.0, water=Water(2.0 + 0j, 0.0, 0.3))
    assert math.isinf(found.distance)
    assert math.isinf(found.radius)


def test_a_vessel_drifts_while_it_brakes_and_until_it_has_turned_into_the_current() -> None:
    found = stop(at(2.0, 0.3), 0.0, 0.0, INSTANT, Water(0.3j))
    # 4 s of braking, 10 s of turning, and 0.3² over twice 0.5
    assert found.way[-1] == pytest.approx(4.0 + 0.3j * (4.0 + 10.0 + 0.3))


def test_a_doubt_about_the_current_widens_the_set() -> None:
    sure, doubtful = (stopped(2.0, water=Water(doubt=doubt)) for doubt in (0.0, 0.1))
    assert doubtful.radius == pytest.approx(sure.radius + 0.1 * (4.0 + 10.0))


@given(
    st.floats(0.05, 3.0),
    st.floats(0.05, 2.0),
    st.floats(-1.0, 1.0),
    st.floats(0.0, 2.0),
    st.floats(0.05, 5.0),
    st.floats(0.0, 1.0),
)
def test_no_drawn_stop_through_lag_and_rate_limit_is_longer(
    U: float, a: float, share: float, lag: float, full: float, dead_time: float
) -> None:
    rate, acting = a / full, share * a
    braking = INSTANT._replace(deceleration=a, lag=lag, rate=rate, dead_time=dead_time)
    predicted = stop(at(U), acting, 0.0, braking, Water()).distance
    dt = 2e-3 * max(U / a, 0.5)
    u, x, force, t = U, 0.0, acting, 0.0
    while u > 0.0 and t < 100.0:
        wanted = -a if t >= dead_time else acting
        change = (wanted - force) * (-math.expm1(-dt / lag) if lag else 1.0)
        force += min(max(change, -rate * dt), rate * dt)
        u, x, t = u + force * dt, x + u * dt, t + dt
    assert x <= predicted * (1.0 + 1e-9) + 2.0 * dt * (U + a * dt)


@given(st.floats(0.01, 10.0), st.floats(0.01, 5.0), st.floats(0.0, 5.0))
def test_the_braking_distance_is_the_integral_of_its_equation(speed: float, net: float, resistance: float) -> None:
    u = np.linspace(0.0, speed, 20_001)
    integral = np.trapezoid(u / (net + resistance * (u / speed) ** 2), u)
    assert braking_distance(speed, net, resistance) == pytest.approx(integral, rel=1e-5)


@given(st.floats(0.1, 5.0), st.floats(0.01, 5.0), st.floats(0.0, 3.0))
def test_the_mean_delay_is_the_area_between_command_and_response(change: float, rate: float, lag: float) -> None:
    dt = 1e-3 * max(change / rate, lag, 1e-2)
    left, area = change, 0.0
    for _ in range(20_000):
        area += left * dt
        step = left * (-math.expm1(-dt / lag) if lag else 1.0)
        left -= min(step, rate * dt)
    assert mean_delay(change, rate, lag) == pytest.approx(area / change, rel=5e-3, abs=2.0 * dt)
