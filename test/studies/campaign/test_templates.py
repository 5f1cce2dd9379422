"""The campaigns that come with the package."""

import math

import pytest

from vessel_hsmc_ros.scenario.named_files import CAMPAIGNS
from vessel_hsmc_ros.studies.batch import simulate_one
from vessel_hsmc_ros.studies.campaign.plan import Campaign

pytestmark = pytest.mark.parametrize("name", CAMPAIGNS.names())


def test_the_campaign_can_be_planned_and_takes_at_most_some_thousand_draws(name: str) -> None:
    campaign = Campaign.load(name)
    assert 100 <= campaign.draws <= 1500
    assert campaign.limits
    assert not campaign.notes


def test_the_first_draw_of_every_law_runs(name: str) -> None:
    campaign = Campaign.load(name)
    for run, law in enumerate(campaign.laws):
        scenario = campaign.scenario(run, {"vessel_sim.duration": 2.0})
        assert scenario.controller.law == law
        outcome = simulate_one(scenario)
        assert not outcome.failure
        assert outcome.metrics is not None
        assert math.isfinite(outcome.metrics.position_error_rms)


def test_nothing_that_a_law_or_the_reference_knows_is_drawn(name: str) -> None:
    # The ship and its environment are uncertain; the designer's settings are not.
    # A ship of the family has an owner and a day of its own, whose declarations and references are the question.
    assert all(parameter.startswith(("vessel_sim.", "ship.")) for parameter in Campaign.load(name).drawn)
