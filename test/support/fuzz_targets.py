"""What is fuzzed: readers of messages, parameters, YAML, bags and CSV.

A target takes mutated bytes. It returns whether they are accepted and raises where a reader did other than accept what is valid
or refuse the rest by an error of this package in one line: `Finding`, or whatever exception escaped.
"""

import dataclasses
import math
import random
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
from fuzz_bags import bag, message, metadata, unchecked_bag
from fuzz_campaigns import campaign as campaign_of
from fuzz_findings import Finding, decided, file
from fuzz_seeds import seeds

from vessel_hsmc_ros.boats.missions.waypoints import read_waypoints
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.schema import Entry
from vessel_hsmc_ros.scenario.fault_script import parse_script
from vessel_hsmc_ros.scenario.parameters_file import read_text
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.identification.measurements import from_csv
from vessel_hsmc_ros.studies.suite import load_suite

NODES = ("vessel_sim", "reference_ship", "controller")


@cache
def _case2() -> str:
    return read_text(share_directory() / "config" / "case2_tracking.yaml")


def _require_numbers(found: Any, place: str = "") -> None:
    """Raise a Finding for NaN anywhere in an accepted value."""
    if isinstance(found, float) and math.isnan(found):
        raise Finding(f"{place} is NaN and was accepted")
    if dataclasses.is_dataclass(found):
        found = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
    if isinstance(found, Mapping):
        for name, value in found.items():
            _require_numbers(value, f"{place}.{name}")
    elif isinstance(found, tuple | list):
        for value in found:
            _require_numbers(value, place)


def _require_ranges(scenario: Scenario) -> None:
    """Raise a Finding for an accepted parameter outside its declared range, or not finite where it must be."""
    for node in NODES:
        own = getattr(scenario, node)
        for name, value in schema.flatten(own).items():
            entry = schema.entries(type(own))[name]
            low = -math.inf if entry.low is None else entry.low
            high = math.inf if entry.high is None else entry.high
            for number in value if isinstance(value, tuple) else (value,):
                infinite = isinstance(number, float) and math.isinf(number) and high != math.inf
                if not isinstance(number, str) and (not low <= number <= high or infinite):
                    raise Finding(f"{node}.{name} = {number} was accepted")


def scenario(data: bytes) -> bool:
    """A ROS parameters file."""
    found = decided(lambda: parse_scenario(data.decode(errors="replace"), "fuzz"))
    if found is not None:
        _require_ranges(found)
    return found is not None


def parameters(data: bytes) -> bool:
    """Changes on the command line."""
    from vessel_hsmc_ros.cli.options import parse_changes

    lines = data.decode(errors="replace").split("\n")
    changes = [line for line in lines if line and line[0] != "@"]
    found = decided(lambda: parse_scenario(_case2(), "fuzz", parse_changes(changes)))
    if found is not None:
        _require_ranges(found)
    return found is not None


def ranges(data: bytes) -> bool:
    """Some parameter with a value that its declaration excludes, on the command line and in a file; the bytes choose."""
    from vessel_hsmc_ros.cli.options import parse_changes

    if data == seeds()["ranges"]:
        return True
    chance = random.Random(data)  # noqa: S311 - not for secrets
    node = chance.choice(NODES)
    name, entry = chance.choice(list(_entries(node).items()))
    value = chance.choice(_excluded(entry))
    text = f"{node}:\n  ros__parameters:\n    {name}: {value}\n"
    for read in (
        lambda: parse_scenario(_case2(), "fuzz", parse_changes([f"{node}.{name}={value}"])),
        lambda: parse_scenario(text, "fuzz"),
    ):
        if decided(read) is not None:
            raise Finding(f"{node}.{name} = {value} was accepted: it must be {entry.allowed}")
    return False


@cache
def _entries(node: str) -> dict[str, Entry]:
    return schema.entries(type(getattr(parse_scenario(_case2(), "fuzz"), node)))


def _excluded(entry: Entry) -> list[str]:
    """Values that a declaration excludes, as YAML."""
    if entry.type is bool:
        return ["2", "0.5", "'true'", "[true]"]
    if entry.type is str:
        return [*(["none_of_these"] if entry.choices else []), "[a]", "{a: 1}", "3.5"]
    if entry.type not in (int, float):
        return ["3", "{a: 1}", "text", "[[1.0]]"]
    limits = [(limit, sign) for limit, sign in ((entry.low, -1), (entry.high, 1)) if limit is not None and math.isfinite(limit)]
    beyond = [format(limit + sign * max(1.0, abs(limit)), "g") for limit, sign in limits]
    return [".nan", "-.inf", "text", "[1.0]", "'1'", "true", *beyond, *([".inf"] if entry.high != math.inf else [])]


def faults(data: bytes) -> bool:
    """A fault script."""
    found = decided(lambda: parse_script(data.decode(errors="replace"), "fuzz"))
    _require_numbers(found and found.faults)
    return found is not None


def suite(data: bytes) -> bool:
    """A suite."""
    found = decided(lambda: load_suite(file(data, "suite.yaml")))
    # The changes are checked when their scenario is loaded.
    _require_numbers([dataclasses.replace(row, changes={}) for row in found or ()])
    return found is not None


def campaign(data: bytes) -> bool:
    """A campaign file, and what it draws."""
    found = campaign_of(data, _case2())
    _require_numbers(found)
    return found is not None


def vessel(data: bytes) -> bool:
    """A vessel file."""
    found = decided(lambda: read_vessel(str(file(data, "vessel.yaml"))))
    _require_numbers(found)
    return found is not None


def csv(data: bytes) -> bool:
    """Measurements as CSV."""
    found = decided(lambda: from_csv(file(data, "run.csv")))
    if found is not None and not (
        np.isfinite(found.time).all() and (np.diff(found.time) > 0.0).all() and np.isfinite(found.wrench).all()
    ):
        raise Finding("measurements with times that do not increase, or a wrench that is not finite, were accepted")
    return found is not None


def waypoints(data: bytes) -> bool:
    """Waypoints as CSV, or as YAML."""
    found = [decided(lambda name=name: read_waypoints(file(data, name))) for name in ("path.csv", "path.yaml")]  # type: ignore[misc]
    for points in found:
        if points is not None and not all(math.isfinite(number) for point in points for number in point):
            raise Finding("a waypoint that is not finite was accepted")
    return any(points is not None for points in found)


TARGETS: dict[str, Callable[[bytes], bool]] = {
    function.__name__: function
    for function in (
        *(message, scenario, parameters, ranges, faults, suite, campaign, vessel),
        *(csv, waypoints, bag, unchecked_bag, metadata),
    )
}
