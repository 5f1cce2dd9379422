"""What is fuzzed: readers of messages, parameters, YAML, bags and CSV.

A target takes mutated bytes. It returns whether they are accepted and raises where a reader did other than accept what is valid
or refuse the rest by an error of this package in one line: `Finding`, or whatever exception escaped.
"""

import dataclasses
import math
import random
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from bag_making import TYPES, write_run
from fuzz_seeds import folder, seeds

from vessel_hsmc_ros.bags.message_decoder import MessageDecoder
from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.campaign.plan import Source
from vessel_hsmc_ros.campaign.plan_file import parse_campaign
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.entry import Entry
from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.identification.measurements import from_csv
from vessel_hsmc_ros.messages.definitions import definition
from vessel_hsmc_ros.scenario.bounded_text import read_text
from vessel_hsmc_ros.scenario.fault_script import parse_script
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.suite import load_suite
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.scenario.waypoints import read_waypoints
from vessel_sim_node.plant import VesselParameters

NODES = ("vessel_sim", "reference_ship", "controller")


class Finding(AssertionError):  # noqa: N818 - a finding of the fuzzing
    """A reader accepted or refused in a way that it must not."""


def _decided(read: Callable[[], Any]) -> Any:
    """What a reader returns, or None where it refused the input by an error of one line."""
    try:
        return read()
    except VesselHsmcError as error:
        if not str(error).isprintable() or not str(error):
            raise Finding(f"an error of several lines, or of none: {error!r}") from error
        return None


def _file(data: bytes, name: str) -> Path:
    path = folder() / name
    path.write_bytes(data)
    return path


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


@cache
def _decoder() -> MessageDecoder:
    return MessageDecoder("/odom", TYPES["odom"], definition(TYPES["odom"]))


def message(data: bytes) -> bool:
    """A serialised message, one by one and in columns, which must agree."""
    decoder = _decoder()
    decoder._layouts, decoder._irregular = {}, False
    one = _decided(lambda: decoder.deserialize(data))
    many = _decided(lambda: decoder.columns(data, np.array([0]), np.array([len(data)]), decoder.fields))
    if one is not None and many is not None:
        for name in ("pose.pose.position.x", "twist.twist.angular.z", "header.stamp.sec"):
            value = one
            for part in name.split("."):
                value = getattr(value, part)
            if not np.array_equal(many[name], [value], equal_nan=True):
                raise Finding(f"{name} is {value} and in columns {many[name]}")
    return one is not None and many is not None


def scenario(data: bytes) -> bool:
    """A ROS parameters file."""
    found = _decided(lambda: parse_scenario(data.decode(errors="replace"), "fuzz"))
    if found is not None:
        _require_ranges(found)
    return found is not None


def parameters(data: bytes) -> bool:
    """Changes on the command line."""
    from vessel_hsmc_ros.cli.options import parse_changes

    lines = data.decode(errors="replace").split("\n")
    changes = [line for line in lines if line and line[0] != "@"]
    found = _decided(lambda: parse_scenario(_case2(), "fuzz", parse_changes(changes)))
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
        if _decided(read) is not None:
            raise Finding(f"{node}.{name} = {value} was accepted: it takes {entry.allowed}")
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
    beyond = [
        format(limit + sign * max(1.0, abs(limit)), "g") for limit, sign in ((entry.low, -1), (entry.high, 1)) if _bounds(limit)
    ]
    return [".nan", "-.inf", "text", "[1.0]", "'1'", "true", *beyond, *([".inf"] if entry.high != math.inf else [])]


def _bounds(limit: float | None) -> bool:
    return limit is not None and math.isfinite(limit)


def faults(data: bytes) -> bool:
    """A fault script."""
    found = _decided(lambda: parse_script(data.decode(errors="replace"), "fuzz"))
    _require_numbers(found and found.faults)
    return found is not None


def suite(data: bytes) -> bool:
    """A suite."""
    found = _decided(lambda: load_suite(_file(data, "suite.yaml")))
    _require_numbers(found)
    return found is not None


def campaign(data: bytes) -> bool:
    """A campaign file."""
    source = Source("fuzz", data.decode(errors="replace"), "case2_tracking", _case2())
    found = _decided(lambda: parse_campaign(source))
    _require_numbers(found)
    return found is not None


def vessel(data: bytes) -> bool:
    """A vessel file."""
    found = _decided(lambda: read_vessel(str(_file(data, "vessel.yaml"))))
    _require_numbers(found)
    return found is not None


def csv(data: bytes) -> bool:
    """Measurements as CSV."""
    found = _decided(lambda: from_csv(_file(data, "run.csv")))
    if found is not None and not (
        np.isfinite(found.time).all() and (np.diff(found.time) > 0.0).all() and np.isfinite(found.wrench).all()
    ):
        raise Finding("measurements with times that do not increase, or a wrench that is not finite, were accepted")
    return found is not None


def waypoints(data: bytes) -> bool:
    """Waypoints as CSV, or as YAML."""
    found = [_decided(lambda name=name: read_waypoints(_file(data, name))) for name in ("path.csv", "path.yaml")]  # type: ignore[misc]
    for points in found:
        if points is not None and not all(math.isfinite(number) for point in points for number in point):
            raise Finding("a waypoint that is not finite was accepted")
    return any(points is not None for points in found)


def _used(opened: Bag) -> bool:
    """Whether what a bag has can be read: its columns, its messages, its run."""
    uses = (opened.load, lambda: list(opened.messages()), lambda: opened.run(VesselParameters().coefficients()))
    for use in (lambda: opened.scenario(), opened.events, opened.diagnostics, lambda: opened.recording):
        _decided(use)
    return None not in [_decided(lambda use=use: (use(), True)) for use in uses]  # type: ignore[misc]


@cache
def _recorded() -> frozenset[tuple[str, int, bytes]]:
    return frozenset((raw.topic, raw.log_time, raw.data) for raw in open_bag(_file(seeds()["bag"], "seed.mcap")).raw_messages())


def bag(data: bytes) -> bool:
    """An MCAP file: its columns, its messages, its run, its scenario; nothing that its checksums exclude is accepted."""
    opened = _decided(lambda: open_bag(_file(data, "run.mcap")))
    if opened is None or not _decided(lambda: _used(opened)):
        return False
    if any((raw.topic, raw.log_time, raw.data) not in _recorded() for raw in opened.raw_messages()):
        raise Finding("a message that was never recorded was accepted")
    return True


def unchecked_bag(data: bytes) -> bool:
    """An MCAP file without compression and checksums, so that mutations reach the readers of records and messages."""
    opened = _decided(lambda: open_bag(_file(data, "unchecked.mcap")))
    return opened is not None and bool(_decided(lambda: _used(opened)))


def metadata(data: bytes) -> bool:
    """A bag's metadata.yaml."""
    made = folder() / "bag"
    if not made.exists():
        write_run(made, 30)
    (made / "metadata.yaml").write_bytes(data)
    return _decided(lambda: open_bag(made).recording) is not None


TARGETS: dict[str, Callable[[bytes], bool]] = {
    function.__name__: function
    for function in (
        *(message, scenario, parameters, ranges, faults, suite, campaign, vessel),
        *(csv, waypoints, bag, unchecked_bag, metadata),
    )
}
