from pathlib import Path
from typing import Any

import pytest
import yaml

from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.markers import MarkerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_sim_node.node import VesselSimNode


@pytest.mark.parametrize("form", ["vessel", "vessel__name"])
def test_every_node_takes_the_hull_of_a_vessel_by_name(bench: Any, form: str) -> None:
    plant = bench.start(VesselSimNode, **{form: "otter"})
    reference = bench.start(ReferenceShipNode, mode="goal", **{form: "otter"})
    controller = bench.start(ControllerNode, law="guided", **{form: "otter"})
    markers = bench.start(MarkerNode, **{form: "otter"})
    assert plant.get_parameter("vessel.sway_yaw_inertia").value == 11.0
    assert plant.get_parameter("actuators.surge_lag").value == 0.1
    assert reference.parameters.vessel.surge_damping == 77.554
    assert controller.parameters.vessel.surge_force_limit == 239.36
    assert markers.parameters.vessel.length == 2.0


def test_explicit_parameters_of_a_node_override_its_vessel(bench: Any) -> None:
    plant = bench.start(VesselSimNode, vessel="otter", vessel__length=2.1)
    assert (plant.parameters.vessel.length, plant.parameters.vessel.beam) == (2.1, 1.08)


def test_an_unknown_vessel_keeps_a_node_from_starting(bench: Any) -> None:
    with pytest.raises(ScenarioError, match="vessel oter is unknown"):
        bench.start(VesselSimNode, vessel="oter")


def test_the_declared_parameters_of_a_node_start_it_again_without_the_vessel_file(bench: Any, tmp_path: Path) -> None:
    path = tmp_path / "boat.yaml"
    path.write_text(
        "vessel: {length: 3.0, beam: 1.2, surge_inertia: 300.0, sway_inertia: 400.0, yaw_inertia: 200.0,"
        " surge_damping: 60.0, sway_damping: 200.0, yaw_damping: 100.0}",
        encoding="utf-8",
    )
    first = bench.start(VesselSimNode, vessel=str(path))
    # What `ros2 param dump` writes, which a parameters file gives back.
    dumped = {name: each.value for name, each in first.get_parameters_by_prefix("").items() if name != "use_sim_time"}
    path.unlink()
    read = yaml.safe_load(yaml.safe_dump({name.replace(".", "__"): _plain(value) for name, value in dumped.items()}))
    assert bench.start(VesselSimNode, **read).parameters == first.parameters


def _plain(value: Any) -> Any:
    return list(value) if not isinstance(value, bool | int | float | str) else value
