"""What the parameters of several nodes of a scenario must have in common."""

from typing import TYPE_CHECKING

from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.timing import RateGrid

if TYPE_CHECKING:
    from vessel_hsmc_ros.scenario.scenario import Scenario


def check_rates(scenario: "Scenario") -> None:
    """Check that in lockstep every control period coincides with an odometry and a reference message.

    Raises:
        ScenarioError: a message rate is not an integer multiple of the control rate.
    """
    if not scenario.controller.lockstep:
        return
    # In lockstep a control period may only begin at an instant for which both messages exist.
    law = RateGrid(scenario.controller.rate_hz)
    for node in ("vessel_sim", "reference_ship"):
        rate_hz = getattr(scenario, node).rate_hz
        if not law.divides(RateGrid(rate_hz)):
            raise ScenarioError(
                f"controller.rate_hz = {law.rate_hz:g} Hz does not fit {node}.rate_hz = {rate_hz:g} Hz:"
                " in lockstep the second must be an integer multiple of the first"
            )


def check_thrusters(scenario: "Scenario") -> None:
    """Check that the allocation has the thrusters of the plant.

    Raises:
        ScenarioError: it has others.
    """
    sim, allocation = scenario.vessel_sim, scenario.thruster_allocation
    names = sim.vessel.thrusters.names
    if sim.by_thrusters and allocation.vessel.thrusters.names != names:
        raise ScenarioError(
            f"thruster_allocation.vessel.thrusters.names = {list(allocation.vessel.thrusters.names)} are not those of vessel_sim,"
            f" {list(names)}: give vessel.thrusters once, in the section /** of all nodes"
        )


def check_late_odometry(scenario: "Scenario") -> None:
    """Check that a lockstep run that rides through missing inputs has odometry of the present step.

    Raises:
        ScenarioError: its odometry is late, so that a missing one looks like one that is on its way.
    """
    sim, controller = scenario.vessel_sim, scenario.controller
    if controller.lockstep and sim.sensors.delay > 0.0 and (controller.ride_through or scenario.faults):
        raise ScenarioError(
            f"vessel_sim.sensors.delay = {sim.sensors.delay:g} s is not allowed in lockstep with scripted faults or"
            " controller.ride_through: it takes 0 s, or a run in real time"
        )
