"""Fuzzing of the readers of messages and bags; the form of a target is that of `fuzz_targets`."""

from functools import cache

import numpy as np
from bag_making import TYPES, write_run
from fuzz_findings import Finding, decided, file
from fuzz_seeds import folder, seeds

from vessel_hsmc_ros.bags.message_decoder import MessageDecoder
from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.messages.definitions import definition
from vessel_sim_node.plant import VesselParameters


@cache
def _decoder() -> MessageDecoder:
    return MessageDecoder("/odom", TYPES["odom"], definition(TYPES["odom"]))


def message(data: bytes) -> bool:
    """A serialised message, one by one and in columns, which must agree."""
    decoder = _decoder()
    decoder._layouts, decoder._irregular = {}, False
    one = decided(lambda: decoder.deserialize(data))
    many = decided(lambda: decoder.columns(data, np.array([0]), np.array([len(data)]), decoder.fields))
    if one is not None and many is not None:
        for name in ("pose.pose.position.x", "twist.twist.angular.z", "header.stamp.sec"):
            value = one
            for part in name.split("."):
                value = getattr(value, part)
            if not np.array_equal(many[name], [value], equal_nan=True):
                raise Finding(f"{name} is {value} and in columns {many[name]}")
    return one is not None and many is not None


def _used(opened: Bag) -> bool:
    """Whether what a bag has can be read: its columns, its messages, its run."""
    uses = (opened.load, lambda: list(opened.messages()), lambda: opened.run(VesselParameters().coefficients()))
    for use in (lambda: opened.scenario(), opened.events, opened.diagnostics, lambda: opened.recording):
        decided(use)
    return None not in [decided(lambda use=use: (use(), True)) for use in uses]  # type: ignore[misc]


@cache
def _recorded() -> frozenset[tuple[str, int, bytes]]:
    return frozenset((raw.topic, raw.log_time, raw.data) for raw in open_bag(file(seeds()["bag"], "seed.mcap")).raw_messages())


def bag(data: bytes) -> bool:
    """An MCAP file: its columns, its messages, its run, its scenario; nothing that its checksums exclude is accepted."""
    opened = decided(lambda: open_bag(file(data, "run.mcap")))
    if opened is None or not decided(lambda: _used(opened)):
        return False
    if any((raw.topic, raw.log_time, raw.data) not in _recorded() for raw in opened.raw_messages()):
        raise Finding("a message that was never recorded was accepted")
    return True


def unchecked_bag(data: bytes) -> bool:
    """An MCAP file without compression and checksums, so that mutations reach the readers of records and messages."""
    opened = decided(lambda: open_bag(file(data, "unchecked.mcap")))
    return opened is not None and bool(decided(lambda: _used(opened)))


def metadata(data: bytes) -> bool:
    """A bag's metadata.yaml."""
    made = folder() / "bag"
    if not made.exists():
        write_run(made, 30)
    (made / "metadata.yaml").write_bytes(data)
    return decided(lambda: open_bag(made).recording) is not None
