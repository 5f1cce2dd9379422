"""A compass that is turned is named by the check, with its angle and what to do; one that fits is OK."""

import math
from typing import Any

import numpy as np
import pytest
from connection_mistakes import columns
from connections import healthy, of
from drawn_drives import draw, sail

from vessel_hsmc_ros.preflight.connection import OK, WRONG, Connection
from vessel_hsmc_ros.preflight.rules import judge

STEP = 0.05


def sailed(angle: float, current: complex = 0.3 - 0.2j, frozen: bool = False, seed: int = 0) -> Connection:
    """The healthy connection with the odometry of legs there and back, whose heading is turned or stands still."""
    rng = np.random.default_rng(seed)
    t: Any = np.arange(0.0, 160.0, STEP)
    side = np.where(t % 80.0 < 40.0, 1.0, -1.0)
    r = np.where(t % 40.0 > 32.0, side * math.pi / 8.0, 0.0)
    psi = 0.3 + np.cumsum(r) * STEP
    ground = (1.5 - 0.9j * r) * np.exp(1j * psi) + current
    place = np.cumsum(ground) * STEP + 0.02 * (rng.normal(size=len(t)) + 1j * rng.normal(size=len(t)))
    measured = np.full(len(t), psi[0]) if frozen else psi + angle
    body = ground * np.exp(-1j * measured)
    base = healthy()
    topic = base.topics["/odom"]
    keep = np.resize(np.arange(len(topic.received)), len(t))
    columns = {name: values[keep] for name, values in topic.columns.items()}
    columns |= {"stamp": 1e3 + t, "x": place.real, "y": place.imag, "psi": np.angle(np.exp(1j * measured))}
    columns |= {"u": body.real, "v": body.imag, "r": np.zeros(len(t)) if frozen else r}
    return base._replace(topics={"/odom": topic._replace(received=1e3 + t + 0.01, columns=columns)})


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("degrees", [-40, -12, 12, 25])
def test_a_turned_compass_is_named_with_its_angle_and_its_correction(degrees: float, seed: int) -> None:
    wrong = [each for each in of(judge(sailed(math.radians(degrees), seed=seed)), WRONG) if each.startswith("compass")]
    assert len(wrong) == 1, wrong
    read = float(wrong[0].split("reads ")[1].split(" deg")[0])
    assert read == pytest.approx(abs(degrees), abs=3.0)
    assert f"to the {'left' if degrees > 0 else 'right'}, +-" in wrong[0]
    correction = float(wrong[0].split("add ")[1].split(" to")[0])
    assert correction == pytest.approx(-math.radians(degrees), abs=0.05)


@pytest.mark.parametrize("current", [0j, 0.5 + 0.1j, -0.4j, 0.6 - 0.5j])
def test_a_compass_that_fits_is_ok_whatever_the_current(current: complex) -> None:
    found = judge(sailed(0.0, current))
    assert [each for each in of(found, WRONG) if each.startswith("compass")] == []
    assert any("it fits the courses of the boat" in each for each in of(found, OK))


def test_a_heading_that_stands_still_is_named() -> None:
    assert any("does not follow the turns" in each for each in of(judge(sailed(0.0, frozen=True)), WRONG))


def accused(connection: Connection) -> bool:
    """Whether the compass is called wrong."""
    return any(each.startswith("compass") for each in of(judge(connection), WRONG))


@pytest.mark.long
def test_a_right_compass_of_a_drawn_boat_is_seldom_accused_and_one_that_stands_still_often() -> None:
    """Hulls whose sway decays slowly, noise, and gusts of up to 0.15 of the force limit; many records are short or straight."""
    boats = [boat for seed in (5, 6) for boat in draw(seed, 150)]
    records = [record for first in range(0, len(boats), 50) for record in sail(boats[first : first + 50])]
    still = columns(psi=lambda c: np.full(len(c["psi"]), c["psi"][0]))
    assert sum(accused(record) for record in records) <= 0.07 * len(boats)
    assert sum(accused(still(record)) for record in records) > 0.3 * len(boats)
