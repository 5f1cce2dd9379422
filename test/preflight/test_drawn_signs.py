"""Verdicts of `check` on signs: none is false on drawn boats under way, and what is not shown is left to do."""

import math
from typing import Any

import numpy as np
import pytest
from connection_mistakes import MISTAKES, changed, columns
from connections import healthy, of
from drawn_drives import HAND, LOOPS, draw, judged, sail
from durations import rest_long

from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Connection
from vessel_hsmc_ros.preflight.rules import judge
from vessel_hsmc_ros.preflight.sign_rules import GRID, effect, smoothed_command, tracked


@pytest.mark.parametrize("seed", rest_long([101, 102]))
def test_no_sign_of_a_drawn_boat_is_false_and_a_good_part_is_shown(seed: int) -> None:
    boats = [boat._replace(seconds=min(boat.seconds, 60.0), begin=0.0) for boat in draw(seed, 40)]
    shown = 0
    for boat, record in zip(boats, sail(boats), strict=True):
        signs, others = judged(boat, record)
        assert others == [], boat
        assert [each for each in signs if each[2] == (WRONG if each[1] else OK)] == [], boat
        shown += sum(level != TODO for _, _, level in signs)
    assert shown > 0.25 * 2 * len(boats)


@pytest.mark.long
def test_throttle_that_goes_with_turns_accuses_no_drive() -> None:
    drives = [drive for drive in HAND if "turns" in drive]
    (first,) = draw(5, 1)
    still: Any = {"noise": (0.0, 0.0, 0.0, 0.0), "current": (0.0, 0.0), "wind": (0.0, 0.0), "gusts": 0.0, "begin": 0.0}
    right = first._replace(flip="right", seconds=90.0, lag=0.3, dead=0.0, every=2, **still)
    boats = [right._replace(hull=hull, drive=drive) for hull in ("heron", "cybership2", "otter", "boat") for drive in drives]
    for boat, record in zip(boats, sail(boats), strict=True):
        signs, others = judged(boat, record)
        assert others == [], boat
        assert all(level != WRONG for _, _, level in signs), boat


@pytest.mark.parametrize(("flip", "level"), rest_long([("right", OK), ("both reversed", WRONG)]))
def test_speeds_that_follow_the_measured_speed_are_judged_right_or_not_at_all(flip: str, level: str) -> None:
    drives = [drive for drive in LOOPS if "cmd_vel" in drive]
    boats = [boat._replace(flip=flip, seconds=60.0, begin=0.0, hull="boat", lag=0.0, dead=0.0) for boat in draw(6, 8, drives)]
    found = {each for boat, record in zip(boats, sail(boats), strict=True) for _, _, each in judged(boat, record)[0]}
    assert level in found
    assert found <= {level, TODO}


def with_fixes(connection: Connection, noise: float, declared: float) -> Connection:
    """The odometry of a receiver of 5 Hz with some noise, held in between."""
    c = connection.topics["/odom"].columns
    n = len(c["x"])
    at = np.arange(n) // 5 * 5
    drawn = np.random.default_rng(3).normal(0.0, noise, (2, n))
    noisy = {name: (c[name] + drawn[k])[at] for k, name in enumerate(("x", "y"))}
    return changed(connection, "/odom", columns={**c, **noisy})._replace(noise=(declared, 0.0))


def test_declared_noise_of_fixes_is_no_jump_and_no_wrong_velocity() -> None:
    connection = with_fixes(healthy(every=2), 0.4, 0.4)
    assert of(judge(connection), WRONG) == []
    jumping = columns(x=lambda c: c["x"] + 30.0 * (np.arange(len(c["x"])) // 250 % 2))(connection)
    assert any("they jump" in text for text in of(judge(jumping), WRONG))


def test_a_reversed_compass_or_yaw_rate_shows_no_signs() -> None:
    compass = columns(psi=lambda c: -c["psi"])(healthy())
    for connection in (compass, MISTAKES["compass heading"][0](healthy()), MISTAKES["yaw rate of FRD"][0](healthy())):
        found = judge(connection)
        assert not any("sign" in text for text in of(found, WRONG))
        assert sum("correct that first" in text for text in of(found, TODO)) == 2
        assert of(found, WRONG)


@pytest.mark.parametrize(("force", "expected"), [(-100.0, "the boat goes astern"), (100.0, "by reversed drives")])
def test_a_boat_that_goes_astern_does_so_by_a_force_astern_or_by_a_mistake(force: float, expected: str) -> None:
    half_turn = columns(psi=lambda c: c["psi"] - math.pi, u=lambda c: -c["u"], v=lambda c: -c["v"])(
        columns("/cmd_wrench", force=lambda c: np.full(len(c["force"]), force))(healthy())
    )
    texts = [text for level, _, text in judge(half_turn) if level == (OK if force < 0.0 else WRONG)]
    assert any(expected in text for text in texts)


def test_a_boat_that_drifts_over_one_heading_is_not_called_wrong() -> None:
    """A current carries it to the side; nothing is commanded."""
    still: Any = {name: lambda c: 0.0 * c["x"] for name in ("y", "u", "r")}
    moving: Any = {
        "x": lambda c: 0.6 * (c["stamp"] - 1e3),
        "psi": lambda c: 0.0 * c["x"] - 1.5,
        "v": lambda c: 0.0 * c["x"] + 0.6,
    }
    drift = columns(**still, **moving)
    found = judge(columns("/cmd_wrench", force=lambda c: 0.0 * c["force"], moment=lambda c: 0.0 * c["moment"])(drift(healthy())))
    assert not any("heading" in text for text in of(found, WRONG))
    assert any("by wind, current or drives" in text for text in of(found, TODO))


@pytest.mark.parametrize(("lag", "dead"), [(0.0, 0.0), (0.0, 0.5), (1.5, 0.0), (1.5, 1.0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_effect_of_a_command_is_found_that_acts_late(lag: float, dead: float, sign: int) -> None:
    """dv/dt = 0.2·F - 0.3·v with F the command through a lag and a dead time."""
    rng, n, width = np.random.default_rng(5), 900, 4
    command = np.repeat(rng.uniform(-1.0, 1.0, n // 30), 30)
    velocity, acting, f = np.zeros(n), np.concatenate((np.zeros(round(dead / GRID)), command))[:n], 0.0
    for k in range(n - 1):
        f = acting[k] if lag == 0.0 else f + GRID / lag * (acting[k] - f)
        velocity[k + 1] = velocity[k] + GRID * (0.2 * sign * f - 0.3 * velocity[k])
    smooth = np.convolve(velocity, np.ones(3 * width + 1) / (3 * width + 1), "valid")
    rate = np.gradient(smooth, GRID)
    found = effect([command], rate, smooth, np.ones((len(rate), 1)), width)
    assert found.sign == sign
    assert found.slope == pytest.approx(0.2 * sign, rel=0.15)


def test_a_command_that_never_changes_shows_nothing() -> None:
    n, width = 600, 4
    rng = np.random.default_rng(2)
    velocity = np.cumsum(rng.normal(0.0, 0.01, n - 3 * width))
    found = effect([np.ones(n)], np.gradient(velocity, GRID), velocity, np.ones((len(velocity), 1)), width)
    assert found.sign == 0


DELAYS = (0, 5, 10, 20)
WIDTH = 16


def steps(seed: int, low: float) -> tuple[np.ndarray, np.ndarray]:
    """Drawn commands in steps from a share to 1, 0 half of the time, and the parts of a current along a heading that wanders."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(low, 1.0, 40) * (rng.random(40) < 0.5), rng.integers(60, 100))
    psi = rng.uniform(-3.0, 3.0) + 0.3 * np.sin(0.01 * np.arange(len(command) - 3 * WIDTH) + rng.uniform(0.0, 6.0))
    return smoothed_command(command, WIDTH), np.column_stack((np.cos(psi), np.sin(psi)))


@pytest.mark.parametrize("speed", rest_long([-1.0, -0.15, 0.15, 3.0]))
def test_a_current_that_carries_a_boat_shows_no_sign(speed: float) -> None:
    """A boat that no command moves, of commands to one side."""
    for seed in range(40):
        command, along = steps(seed, 0.2)
        start = along[0] / np.linalg.norm(along[0])
        carried = speed * along @ start + np.random.default_rng(seed).normal(0.0, 0.05, len(command))
        assert tracked(command, carried, along, DELAYS) == 0, seed


@pytest.mark.parametrize("sign", [1, -1])
def test_a_velocity_that_follows_its_command_in_a_current_shows_the_sign(sign: int) -> None:
    found = []
    for seed in range(40):
        command, along = steps(seed, -1.0)
        measured = sign * np.concatenate((np.zeros(5), command[:-5])) + along @ [0.1, -0.1]
        found.append(tracked(command, measured, along, DELAYS))
    assert set(found) <= {0, sign}
    assert np.count_nonzero(found) > 15


def test_a_speed_command_that_is_made_from_a_speed_of_the_other_sign_is_not_followed() -> None:
    """The command is always ahead of the measured speed, which is astern most of the time; in turns both are astern."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        turn = np.convolve(rng.random(2000) < 0.002, np.exp(-0.015 * np.arange(400)))[:2000]
        speed = -0.02 - 0.4 * np.minimum(turn, 1.0)
        along = np.column_stack((np.cos(0.01 * np.arange(2000)), np.sin(0.01 * np.arange(2000))))
        assert tracked(speed + 0.04, speed, along, DELAYS) <= 0, seed
