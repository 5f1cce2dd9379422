"""A law of a file in the controller node: its parameters are ROS parameters, and it is retuned while it runs."""

from pathlib import Path
from typing import Any

import pytest
from driving import STEP, RealTimePlant
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient

from vessel_hsmc_ros import load_law_file
from vessel_hsmc_ros.core.exceptions import LawError, ParameterError
from vessel_hsmc_ros.nodes.controller import ControllerNode

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "my_law.py"

pytestmark = pytest.mark.usefixtures("laws")


def step(bench: Any, plant: Any) -> tuple[float, float]:
    count = len(plant.commands)
    plant.send_reference(count * STEP)
    plant.send_odometry(count * STEP)
    bench.until(lambda: len(plant.commands) == len(plant.states) == count + 1)
    wrench = plant.commands[-1].wrench
    return wrench.force.x, wrench.torque.z


def set_parameter(bench: Any, name: str, value: float) -> Any:
    client = AsyncParameterClient(bench.probe, "controller")
    bench.until(client.services_are_ready)
    future = client.set_parameters([Parameter(name, value=value)])
    return bench.until(lambda: future.done() and future.result()).results[0]


def test_a_gain_of_an_own_law_is_changed_while_it_runs_within_its_range(bench: Any, plant: Any) -> None:
    load_law_file(EXAMPLE)
    plant.connect(bench.start(ControllerNode, law="my_law", my_law__surge_gain=0.01))
    before = step(bench, plant)
    assert set_parameter(bench, "my_law.surge_gain", 0.02).successful
    assert step(bench, plant)[0] != before[0]
    assert not set_parameter(bench, "my_law.surge_gain", -1.0).successful


def test_a_misspelt_parameter_of_an_own_law_is_refused_at_the_start(bench: Any) -> None:
    load_law_file(EXAMPLE)
    with pytest.raises(ParameterError, match=r"controller\.my_law\.lookahed is not a parameter: did you mean my_law\.lookahead"):
        bench.start(ControllerNode, law="my_law", my_law__lookahed=3.0)


def test_without_its_file_an_own_law_is_refused_with_the_remedy(bench: Any) -> None:
    with pytest.raises(ParameterError, match=r"controller\.law must be .*\(got my_law\).* needs --law-file FILE\.py"):
        bench.start(ControllerNode, law="my_law", my_law__lookahead=3.0)


RETUNE = """
    def retune(self, parameters):
        self.parameters = parameters
        1.0 / (parameters.lookahead - 5.0)
"""


def test_new_gains_for_which_the_code_of_a_law_fails_are_refused(bench: Any, plant: Any, tmp_path: Path) -> None:
    (tmp_path / "my_law.py").write_text(EXAMPLE.read_text(encoding="utf-8") + RETUNE, encoding="utf-8")
    load_law_file(tmp_path / "my_law.py")
    plant.connect(bench.start(ControllerNode, law="my_law"))
    result = set_parameter(bench, "my_law.lookahead", 5.0)
    assert not result.successful
    assert "ZeroDivisionError: float division by zero" in result.reason


def failing(folder: Path, exception: str) -> None:
    """Load the example with a step that raises an exception."""
    text = EXAMPLE.read_text(encoding="utf-8").replace("        p, ship = ", f"        raise {exception}\n        p, ship = ")
    (folder / "my_law.py").write_text(text, encoding="utf-8")
    load_law_file(folder / "my_law.py")


def test_in_real_time_an_exception_in_the_code_of_a_law_ends_the_node(bench: Any, simulated_time: Any, tmp_path: Path) -> None:
    failing(tmp_path, "KeyError(3)")
    sea = RealTimePlant(bench, simulated_time)
    sea.start(ControllerNode, law="my_law")
    with pytest.raises(LawError, match=r"law my_law failed at .*my_law\.py:\d+: KeyError: 3"):
        sea.run(0.1)
    assert not any(any(wrench) for wrench in sea.wrenches())
