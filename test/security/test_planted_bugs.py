"""Each target of the fuzzing finds a bug of its kind that is planted into its reader."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from durations import rest_long
from fuzz_seeds import seeds
from fuzz_targets import TARGETS
from mcap.records import Chunk
from mcap.stream_reader import get_chunk_data_stream
from mutation import mutated

from vessel_hsmc_ros.bags.topic_columns import _Walk
from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.scenario import vessels

EXAMPLES = 600


def unwrapped(decoder: Any, data: bytes) -> Any:
    """A message, with the exceptions of its reader."""
    return _Walk(data, "<", decoder._types, decoder._classes, None).message(decoder._kind, "")


def unchecked(chunk: Chunk, validate_crc: bool) -> Any:
    """The content of a chunk, whatever its checksum."""
    del validate_crc
    return get_chunk_data_stream(chunk)


def waypoint(row: Any, place: str) -> Any:
    """A waypoint of any numbers."""
    del place
    return tuple(map(float, row))


ROOM = "vessel_hsmc_ros"
PLANTED: dict[str, tuple[str, str, Any]] = {
    "bytes behind the last field": ("message", "bags.topic_columns.UNUSED", 10_000),
    "numbers that are not aligned": ("message", "bags.topic_columns._Walk.align", lambda *_: None),
    "no ranges in a scenario": ("scenario", "core.schema._outside", lambda *_: False),
    "no ranges of changes": ("parameters", "core.schema._outside", lambda *_: False),
    "no ranges at all": ("ranges", "core.schema._outside", lambda *_: False),
    "no ranges of faults": ("faults", "core.schema._outside", lambda *_: False),
    "YAML with its own exceptions in a suite": ("suite", "studies.suite.parsed", lambda text, _: yaml.safe_load(text)),
    "limits of a campaign": ("campaign", "studies.campaign.plan._limits", dict),
    "numbers of a campaign": ("campaign", "studies.campaign.plan._integer", lambda entries, key, *_: entries.get(key, 1)),
    "draws beyond their distribution": (
        "campaign",
        "studies.campaign.distributions.Uniform.quantile",
        lambda self, u: self.high + u,
    ),
    "no ranges of hull data": ("vessel", "core.schema._outside", lambda *_: False),
    "times that do not increase": ("csv", "studies.identification.measurements.checked", lambda run: run),
    "a waypoint that is not finite": ("waypoints", "boats.missions.waypoints._waypoint", waypoint),
    "no checksums": ("bag", "bags.mcap_contents.get_chunk_data_stream", unchecked),
    "messages with their own exceptions": ("unchecked_bag", "bags.topic_columns.MessageDecoder.deserialize", unwrapped),
    "metadata that is no YAML": ("metadata", "bags.rosbag2_metadata.yaml", SimpleNamespace(YAMLError=KeyError)),
}
"""Target, what is replaced in its reader, and by what."""


@pytest.fixture
def _forgotten() -> Iterator[None]:
    """Keep what a planted bug accepted from later tests."""
    yield
    vessels._parsed.cache_clear()


def test_there_is_a_planted_bug_for_every_target() -> None:
    assert {target for target, _, _ in PLANTED.values()} == set(TARGETS)


@pytest.mark.usefixtures("_forgotten")
@pytest.mark.parametrize("bug", rest_long(PLANTED))
def test_a_planted_bug_is_found(bug: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, place, planted = PLANTED[bug]
    target, valid = TARGETS[name], seeds()[name]
    assert target(valid)
    monkeypatch.setattr(f"{ROOM}.{place}", planted)
    for seed in range(EXAMPLES):
        try:
            target(mutated(valid, seed))
        except VesselHsmcError:
            raise
        except Exception:
            return
    pytest.fail(f"{EXAMPLES} examples of {name} have not found it")
