"""Fault scripts: YAML text to faults, and back."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.faults import Fault, FaultScript, check_settings
from vessel_hsmc_ros.scenario.parameters_file import FAULTS, parsed, read_file, read_yaml


def parse_script(text: str, source: str) -> FaultScript:
    """Make a script from its text."""
    document = parsed(text, source)
    if not isinstance(document, dict) or FAULTS not in document:
        raise ScenarioError(f"{source} is not a fault script: it must have seed and a list named faults")
    if unknown := document.keys() - {"seed", "faults"}:
        raise ScenarioError(f"{source}: {sorted(map(str, unknown))[0]} is unknown: a fault script has seed and faults")
    seed = document.get("seed", 0)
    if type(seed) is not int or not 0 <= seed < 2**32:
        raise ScenarioError(f"{source}: seed must be an integer from 0 to {2**32 - 1} (got {seed!r})")
    return FaultScript(_faults(document[FAULTS], source), seed)


def load_script(path: Path) -> FaultScript:
    """Read a fault script."""
    return parse_script(read_file(path, "fault script"), f"fault script {path}")


def faults_of_scenario(text: str, seed: int, source: str) -> FaultScript | None:
    """The script in the section `faults` of a scenario; None if it has none.

    `seed`: the seed of the scenario, which is that of the faults too.
    """
    document = read_yaml(text)
    if not isinstance(document, dict) or FAULTS not in document:
        return None
    return FaultScript(_faults(document[FAULTS], source), seed)


def _faults(listed: object, source: str) -> tuple[Fault, ...]:
    if not isinstance(listed, list):
        raise ScenarioError(f"{source} is not a fault script: faults must be a list")
    return tuple(_fault(entry, f"faults[{index}]", source) for index, entry in enumerate(listed))


def _fault(entry: object, owner: str, source: str) -> Fault:
    if not isinstance(entry, Mapping):
        raise ScenarioError(f"{source}: {owner} must be settings such as at, kind and topic (got {entry!r})")
    # Of the changes of a field, nan and inf are numbers in YAML as ROS reads it.
    values = {str(name): str(value) if name == "change" and isinstance(value, float) else value for name, value in entry.items()}
    fault = schema.build(Fault, values, owner)
    check_settings(fault, values, owner)
    return fault


def dump_script(script: FaultScript) -> str:
    """Write a script as YAML, with the settings that differ from their defaults."""
    default = schema.flatten(Fault())
    entries: list[dict[str, Any]] = []
    for fault in script.faults:
        values = schema.flatten(fault)
        entries.append({n: v for n, v in values.items() if n in ("at", "kind") or v != default[n]})
    return yaml.safe_dump({"seed": script.seed, "faults": entries}, sort_keys=False)
