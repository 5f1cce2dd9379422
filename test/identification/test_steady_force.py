"""Why a run that was not used is predicted badly: the steady force that would explain it."""

import numpy as np
import pytest

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.identification.steady_force import steady_force
from vessel_hsmc_ros.identification.types import Measurements
from vessel_hsmc_ros.identification.windows import simulated, unrolled, windows
from vessel_sim_node.plant import VesselParameters

SHIP = VesselParameters()
HULL = {name: value for name, value in schema.flatten(SHIP).items() if isinstance(value, float)}
WINDOW = 20.0
TIME = np.arange(0.0, 60.5, 0.5)


def sailed(force: tuple[float, float], gain: float = 1.0) -> Measurements:
    """A run of the ship with a steady force in the earth frame, and with its wrench multiplied by a gain."""
    wrench = np.column_stack([1e5 + 0.0 * TIME, 0.0 * TIME, 2e5 * np.sin(0.2 * TIME)])
    blank = Measurements(TIME, np.zeros((len(TIME), 3)), np.zeros((len(TIME), 3)), wrench)
    cut = windows([blank], 60.0)
    parts = simulated(cut, np.zeros((1, 6)), SHIP.coefficients(), np.full(3, gain), np.array([*force, 0.0]))
    states = unrolled(cut, parts, len(TIME))
    return Measurements(TIME, states[:, :3], states[:, 3:], wrench, "windy")


def test_a_wind_that_the_other_runs_did_not_have_is_found_and_explains_the_run() -> None:
    found = steady_force(HULL, sailed((3e3, -4e3)), WINDOW, {})
    assert (found.east, found.north) == pytest.approx((3e3, -4e3), rel=0.1)
    assert found.explains
    assert found.sentence("windy").startswith("windy: a steady force of 4.9")
    assert "towards -5" in found.sentence("windy")


def test_a_force_is_not_offered_where_it_does_not_explain_the_run() -> None:
    run = sailed((0.0, 0.0))
    turned = run._replace(wrench=run.wrench * [1.0, 1.0, -1.0])
    found = steady_force(HULL, turned, WINDOW, {})
    assert not found.explains
    assert found.sentence("windy").startswith("windy: no steady force explains the position error of ")


def test_the_force_is_found_beside_the_offset_that_was_identified() -> None:
    found = steady_force(HULL, sailed((4e3, -4e3)), WINDOW, {"force_x": 1e3})
    assert (found.east, found.north) == pytest.approx((3e3, -4e3), rel=0.1)
