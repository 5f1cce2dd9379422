"""A lockstep run whose controller was changed, disabled and reset on the way is verified bit by bit."""

from pathlib import Path
from typing import Any

from std_srvs.srv import SetBool, Trigger

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.recorder import RecorderNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.runs.verification import verify
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario
from vessel_sim_node.node import VesselSimNode

NODES = (RecorderNode, ReferenceShipNode, ControllerNode, VesselSimNode)
RATES = {f"{node.NAME}.rate_hz": 10.0 for node in NODES[1:]}


def start_all(bench: Any, folder: Path) -> dict[str, Any]:
    """The nodes of a lockstep run with a recorder."""
    point = {"vessel.sway_yaw_inertia": 6e5}  # the filter of the centre of percussion is a state of the controller too
    changes = {"controller.law": "guided", **point, **{f"{node.NAME}.recorded": True for node in NODES}, **RATES}
    (folder / "params.yaml").write_text("", encoding="utf-8")
    scenario = load_scenario("case2_tracking", changes).with_bag(folder / "bag", folder / "params.yaml")
    (folder / "params.yaml").write_text(dump_scenario(scenario), encoding="utf-8")
    started = {}
    for node_class in NODES:
        values = schema.flatten(getattr(scenario, node_class.NAME)).items()
        parameters = {name: list(value) if isinstance(value, tuple) else value for name, value in values}
        started[node_class.NAME] = bench.start(node_class, **parameters)
    return started


def test_a_run_with_events_is_verified_with_them(bench: Any, tmp_path: Path) -> None:
    nodes = start_all(bench, tmp_path)
    assert bench.set_parameters("controller", guided__integral_gain=0.01).successful  # before the first step

    def advance(steps: int) -> None:
        plant = nodes["vessel_sim"]
        end = plant.status()[2]["steps"] + steps
        bench.until(lambda: plant.status()[2]["steps"] >= end)

    advance(5)
    assert bench.set_parameters("controller", guided__position_gain=0.5, guided__integral_limit=0.2).successful
    advance(20)
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=False)).success
    advance(5)
    assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=True)).success
    advance(20)
    assert bench.call(Trigger, "/controller/reset", Trigger.Request()).success
    advance(20)
    assert bench.call(SetBool, "/vessel_sim/pause", SetBool.Request(data=True)).success
    bench.spin(0.3)
    nodes["recorder"].close()

    bag = open_bag(tmp_path / "bag")
    kinds = [event.kind for event in bag.events()]
    assert kinds == ["parameter", "parameter", "parameter", "disable", "enable", "reset", "pause"]
    found = verify(bag, bag.scenario())
    assert found.largest == (0.0, 0.0)
    assert len(found.differing) == 0
    assert not found.recorded.any(axis=1).all(), "the wrench was zero while the controller was disabled"
    assert bag.events()[0].time < 0.0
    assert bag.scenario(at=0.0).controller.guided.integral_gain == 0.01
    assert bag.scenario(at=0.0).controller.guided.position_gain == -1.0
    assert bag.scenario(at=found.time[-1]).controller.guided.position_gain == 0.5
