"""Fuzzing of the readers of messages and bags; the form of a target is that of `fuzz_targets`."""

from functools import cache
from operator import attrgetter
from typing import Any

import numpy as np
from bag_making import STORE, TYPES, write_run
from fuzz_findings import Finding, decided, file
from fuzz_seeds import folder, seeds

from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.bags.topic_columns import MessageDecoder
from vessel_hsmc_ros.messages.topics import definition
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters


@cache
def _decoder() -> MessageDecoder:
    return MessageDecoder("/odom", TYPES["odom"], definition(TYPES["odom"]))


def _independent(data: bytes) -> Any:
    """The message as rosbags reads it; None if it refuses it, by whatever exception."""
    try:
        return STORE.deserialize_cdr(data, TYPES["odom"])
    except Exception:
        return None


def message(data: bytes) -> bool:
    """A serialised message: by itself, in columns behind a valid one, and as rosbags reads it, which must all agree."""
    decoder, valid = _decoder(), seeds()["message"]
    decoder._layouts, decoder._irregular = {}, False
    starts, sizes = np.array([0, len(valid)]), np.array([len(valid), len(data)])
    one, expected = decided(lambda: decoder.deserialize(data)), _independent(data)
    many, readable = decoder.columns(valid + data, starts, sizes, decoder.fields)
    if not (one is not None) == readable[1] == (expected is not None):
        raise Finding(f"read by itself: {one is not None}, in columns: {readable[1]}, by rosbags: {expected is not None}")
    if one is None:
        return False
    for name in decoder.fields:
        values = [attrgetter(name)(one), many[name][1], attrgetter(name)(expected)]
        arrays = [np.asarray(value) for value in values]
        if not all(np.array_equal(arrays[0], each, equal_nan=each.dtype.kind == "f") for each in arrays[1:]):
            raise Finding(f"{name} is {values[0]}, in columns {values[1]}, by rosbags {values[2]}")
    return True


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
    """A bag's metadata.yaml; the file of the bag has the name that the seed gives it."""
    made = folder() / "described" / "seed"
    if not made.exists():
        write_run(made, 30)
    (made / "metadata.yaml").write_bytes(data)
    return decided(lambda: open_bag(made).recording) is not None
