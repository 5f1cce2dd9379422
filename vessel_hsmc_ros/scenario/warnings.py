"""Warnings on a scenario that is valid, but probably not what was meant, and on settings that have no effect."""

from collections.abc import Collection

from vessel_hsmc_ros.control.laws.hierarchical_parameters import sway_warning
from vessel_hsmc_ros.core.hull import another_ship, kept
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import make_reference
from vessel_hsmc_ros.guidance.waypoints import scheduled_goals, scheduled_path
from vessel_hsmc_ros.plant.hull_parameters import hull_warning
from vessel_hsmc_ros.scenario.parameters import ineffective
from vessel_hsmc_ros.scenario.scenario import Scenario

SHIPS = (PLANT, REFERENCE, CONTROLLER)  # the nodes that have hull data
FORCES = ("surge_force", "sway_force", "yaw_moment")


def check_scenario(scenario: Scenario) -> list[str]:
    """Find what a scenario leaves at the paper's values although it describes another ship, and a law that was not chosen.

    Returns one line for each finding; none for the scenarios of the package.
    """
    found = []
    if any(another_ship(getattr(scenario, node).vessel) for node in SHIPS):
        found = [*_partial_hull(scenario), *_papers_disturbance(scenario)]
    if gain := hull_warning(scenario.vessel_sim.vessel):
        found.append(gain)
    c = scenario.controller
    sway = sway_warning(c.hierarchical, c.vessel.as_controlled(), RateGrid(c.rate_hz).period) if c.law == "hierarchical" else ""
    found += [sway] if sway else []
    reference = scenario.reference_ship
    if reference.mode == "path":  # its plan is the one of the check of the scenario
        slow = getattr(make_reference(reference, 1.0 / reference.rate_hz), "slow", "")
        found += [f"reference_ship.path: {slow}"] if slow else []
    if "controller.law" not in scenario.given:
        found.append(
            f"controller.law is not given: it is {scenario.controller.law}, the law of the paper; guided suits every ship"
        )
    return found


def check_effects(scenario: Scenario, commanded: Collection[str] = (), given: Collection[str] | None = None) -> list[str]:
    """Find the settings of a scenario that are given and have no effect.

    `given`: those of its file that are judged as well; None for all. Returns one line for each finding; none for the scenarios
    of the package.
    """
    lines: list[str] = []
    of_file = scenario.given if given is None else given
    for node in SHIPS:
        given, own = (_of_node(node, names) for names in (of_file, commanded))
        lines += ineffective(node, getattr(scenario, node), given, own)
    return lines


def check_goals(scenario: Scenario) -> list[str]:
    """Find that the reference of a scenario waits for messages, which a run without ROS does not have."""
    p = scenario.reference_ship
    goals = any(time >= 0.0 for time, _ in scheduled_goals(p.goal))
    set_alone = {"goal": (goals, "goal.poses"), "path": (scheduled_path(p.path, p.motion.speed) is not None, "path.waypoints")}
    is_set, name = set_alone.get(p.mode, (True, ""))
    return [] if is_set else [f"reference_ship.mode = {p.mode} has no effect without {name}: the reference stays at initial_pose"]


def _of_node(node: str, names: Collection[str]) -> set[str]:
    return {name.removeprefix(f"{node}.") for name in names if name.startswith(f"{node}.")}


def _partial_hull(scenario: Scenario) -> list[str]:
    """The hull data that another ship has in common with the paper's ship."""
    remaining = {node: kept(getattr(scenario, node).vessel) for node in SHIPS}
    texts: list[str] = []
    for name, text in {key: value for of_node in remaining.values() for key, value in of_node.items()}.items():
        nodes = [node for node in SHIPS if hasattr(getattr(scenario, node).vessel, name)]
        keeping = [node for node in nodes if name in remaining[node]]
        texts += [f"vessel.{text}"] if keeping == nodes else [f"{node}.vessel.{text}" for node in keeping]
    advice = "give them in a section `vessel` for all nodes (vessel-hsmc init writes one)"
    return (
        [f"only a part of the hull is given, the paper's ship's values remain in {', '.join(texts)}: {advice}"] if texts else []
    )


def _papers_disturbance(scenario: Scenario) -> list[str]:
    """The disturbance of the paper's ship, where it acts on another one."""
    remaining = [text for name, text in kept(scenario.vessel_sim.disturbance.periodic).items() if name in FORCES]
    if not remaining or not another_ship(scenario.vessel_sim.vessel):
        return []
    return [
        f"the paper's disturbance acts on another ship: vessel_sim.disturbance.periodic has {', '.join(remaining)};"
        " set them to 0 for calm water"
    ]
