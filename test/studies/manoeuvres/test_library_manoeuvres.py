"""All vessels of the library perform all manoeuvres."""

import math

import pytest
from compiling import only_compiled
from durations import rest_long

from vessel_hsmc_ros.scenario.vessels import vessel_names
from vessel_hsmc_ros.studies.manoeuvres.page import UNITS, notes, rows
from vessel_hsmc_ros.studies.manoeuvres.run import PLANS, run, ship_named

pytestmark = only_compiled

MAY_TAKE_LONG = {"spiral"}
"""At the edge of its loop a ship takes very long to settle, which a note states."""


@pytest.mark.parametrize("vessel", rest_long(vessel_names(), 4))
def test_every_vessel_performs_every_manoeuvre(vessel: str) -> None:
    results = run(ship_named(vessel))
    assert list(results.manoeuvres) == list(PLANS)
    for name, done in results.manoeuvres.items():
        assert not done.failure, (name, done.failure)
        assert done.complete or name in MAY_TAKE_LONG, (name, done.metrics)
        assert not any(map(math.isnan, done.metrics.values())), (name, done.metrics)
        assert set(done.metrics) <= set(UNITS)
        # What is unbounded or doubtful has its sentence.
        assert list(notes(done)) or (done.complete and all(map(math.isfinite, done.metrics.values())))
    assert len(rows(results)) == sum(map(len, results.metrics.values()))
    ship = results.ship
    assert 0.5 * ship.top_speed < ship.speed < ship.top_speed
    assert results.metrics["speed_run"]["top_speed"] == pytest.approx(ship.top_speed, rel=0.02)
