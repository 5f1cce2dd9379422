"""A rule on the command line that names another node is refused with the rule that reaches this one."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from harness import Command

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters_file import check_rules

NODE = [sys.executable, "-m", "vessel_hsmc_ros.nodes", "controller"]


@pytest.mark.parametrize(
    ("rule", "namespace", "reached"),
    [
        ("law:=guided", "/alpha", True),
        ("controller:law:=guided", "/", True),
        ("controller:law:=guided", "/alpha", False),
        ("vessel_sim:mass:=1.0", "/", False),
    ],
)
def test_a_rule_of_a_parameter_reaches_the_nodes_that_ros_gives_it_to(rule: str, namespace: str, reached: bool) -> None:
    arguments = ["--ros-args", "-p", rule]
    if reached:
        check_rules(arguments, "controller", namespace)
        return
    with pytest.raises(ParameterError, match="reaches no node: this one is /"):
        check_rules(arguments, "controller", namespace)


def test_a_remapping_for_another_node_is_refused_and_one_of_this_node_is_not() -> None:
    check_rules(["--ros-args", "-r", "controller:odom:=/odom", "-r", "odom:=/odom", "-r", "__ns:=/alpha"], "controller", "/alpha")
    with pytest.raises(ParameterError, match="write -r odom:=/odom"):
        check_rules(["--ros-args", "-r", "control:odom:=/odom"], "controller", "/")


def test_what_follows_the_ros_arguments_is_not_a_rule() -> None:
    check_rules(["-p", "other:law:=pd", "--ros-args", "--", "-p", "other:law:=pd"], "controller", "/")


def test_a_node_in_a_namespace_names_the_rule_that_would_reach_it() -> None:
    arguments = ["--ros-args", "-r", "__ns:=/alpha", "-p", "controller:law:=guided"]
    done = subprocess.run([*NODE, *arguments], capture_output=True, text=True, timeout=60.0)
    assert done.returncode == 2
    assert "-p controller:law:=guided reaches no node: this one is /alpha/controller" in done.stderr
    assert "write -p law:=guided" in done.stderr


def test_the_rule_that_is_named_reaches_a_node_in_a_namespace_before_the_section_of_the_file(tmp_path: Path) -> None:
    scenario = Path(__file__).resolve().parents[2] / "config" / "case2_tracking.yaml"
    arguments = ["--ros-args", "-r", "__ns:=/alpha", "--params-file", scenario, "-p", "law:=pd"]
    node = Command([*NODE, *arguments], tmp_path, {})
    node.until(lambda: "\n" in node.text, 60.0)
    node.popen.send_signal(signal.SIGINT)
    assert node.wait(60.0) == 0
    assert "law pd at 100 Hz" in node.text.splitlines()[0]
