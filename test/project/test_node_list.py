"""The list of the package's nodes, and the files that must agree with it."""

import importlib
from importlib.metadata import entry_points
from pathlib import Path

import definitions
import pytest
from policy import POLICY, policy

from vessel_hsmc_ros.core.node_list import LOOP, PROGRAMS, WATCHERS
from vessel_hsmc_ros.nodes import entry_points as node_scripts
from vessel_hsmc_ros.scenario import parameters


def test_every_node_declares_its_parameters() -> None:
    assert list(parameters.NODES) == list(LOOP)
    assert parameters.WATCHERS.keys() == WATCHERS.keys()


@pytest.mark.parametrize("name", PROGRAMS)
def test_every_node_has_its_executable_and_module(name: str) -> None:
    program = PROGRAMS[name]
    if name == "px4" and definitions.module("px4_msgs.msg") is None:
        pytest.skip("px4_msgs is neither installed nor can be compiled here")
    scripts = {point.name: point.value for point in entry_points(group="console_scripts")}
    assert scripts[program.executable] == f"{node_scripts.__name__}:{program.executable}"
    assert callable(getattr(node_scripts, program.executable))
    assert name == getattr(importlib.import_module(program.source), program.kind).NAME


@pytest.mark.parametrize("name", parameters.NODES | parameters.WATCHERS)
def test_a_node_that_is_started_alone_runs_in_real_time_and_is_not_recorded(name: str) -> None:
    declared = (parameters.NODES | parameters.WATCHERS)[name]()
    assert not declared.lockstep
    assert not declared.recorded
    assert declared.frame_prefix == ""


def test_a_new_node_is_its_module_its_parameters_and_an_entry_of_the_list() -> None:
    """As the watchdog is named; the policy is generated; a node that a stack starts is in stacks.yaml too."""
    root = Path(__file__).resolve().parents[2]
    tops = (root / top for top in ("vessel_hsmc_ros", "vessel_sim_node", "config", "launch"))
    files = [root / "setup.py", *(path for top in tops for path in top.rglob("*") if path.suffix in (".py", ".yaml", ".xml"))]
    naming = {path for path in files if "watchdog" in path.read_text(encoding="utf-8").lower()}
    package = root / "vessel_hsmc_ros"
    own = {package / "boats" / "drive.py", package / "boats" / "parameters.py", package / "core" / "node_list.py"}
    assert naming - {POLICY} == own


def test_the_policy_is_generated_from_the_nodes() -> None:
    assert POLICY.read_text(encoding="utf-8") == policy(), "run `make docs`"
