"""What is fuzzed: readers of messages, parameters, YAML, bags and CSV, each with a valid input that is mutated.

A target takes mutated bytes. It returns whether they are accepted and raises where a reader did other than accept what is valid
or refuse the rest by an error of this package in one line: `Finding`, or whatever exception escaped.
"""

import copy
import io
import math
import random
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from bag_making import TYPES, write_run
from mcap.writer import CompressionType, Writer

from vessel_hsmc_ros.bags.message_decoder import MessageDecoder
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.campaign.plan import Source
from vessel_hsmc_ros.campaign.plan_file import parse_campaign
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.identification.measurements import from_csv
from vessel_hsmc_ros.messages.definitions import definition
from vessel_hsmc_ros.scenario.bounded_text import read_text
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.suite import load_suite
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.scenario.waypoints import read_waypoints
from vessel_sim_node.plant import VesselParameters

VALUES = (
    *(
        b"nan",
        b"-.inf",
        b".nan",
        b"1e400",
        b"-1e-320",
        b"0x" + b"f" * 5000,
        b"9" * 5000,
        b"2001-99-99",
        b"true",
        b"~",
        b"''",
        b"[]",
    ),
    *(
        b"[[[[]]]]",
        b"{}",
        b"&a [*a]",
        b"*a",
        b"!!int x",
        b"!!python/object/apply:os.system [id]",
        b"!!binary x",
        b"<<: *a",
        b"\t",
    ),
    *(
        b"\x00",
        b"\xff\xff\xff\xff",
        b"\x00\x00\x00\x80",
        b"\xff" * 8,
        b"\x7f" * 8,
        b"\r",
        b"\n",
        b'"',
        b",,",
        b"\xe2\x80\xa8",
        b"1_0",
    ),
)
"""What is put in: numbers at the edge, tags, aliases, lengths, line ends."""


class Finding(AssertionError):  # noqa: N818 - a finding of the fuzzing
    """A reader accepted or refused in a way that it must not."""


def mutated(data: bytes, seed: int) -> bytes:
    """Some bytes with one to four mutations: bits, values, cuts, repetitions, exchanged parts."""
    chance = random.Random(seed)  # noqa: S311 - not for secrets
    found = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(found) + 1)
        end = min(len(found), at + chance.choice((1, 2, 4, 8, 30)))
        kind = chance.randrange(6)
        if kind == 0 and at < len(found):
            found[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            found[at:end] = chance.choice(VALUES)
        elif kind == 2:
            found[at:at] = chance.choice(VALUES)
        elif kind == 3:
            del found[at : at + chance.choice((1, 4, 100, 10_000))]
        elif kind == 4:
            found[at:at] = found[at:end] * chance.choice((1, 3, 200))
        else:
            other = chance.randrange(len(found) + 1)
            found[at:end] = found[other : other + end - at]
    return bytes(found)


def _decided(read: Callable[[], object]) -> object:
    """What a reader returns, or None where it refused the input by an error of one line."""
    try:
        return read()
    except VesselHsmcError as error:
        if not str(error).isprintable() or not str(error):
            raise Finding(f"an error of several lines, or of none: {error!r}") from error
        return None


def _file(data: bytes, name: str) -> Path:
    path = _folder() / name
    path.write_bytes(data)
    return path


@cache
def _folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="fuzz_"))


def _in_range(node: str, values: Mapping[str, object]) -> None:
    """Raise a Finding for an accepted value outside its declared range, or not finite where it must be."""
    for name, entry in schema.entries(type(NODES[node]()) if isinstance(NODES[node], type) else NODES[node]).items():
        found = values[name]
        for number in found if isinstance(found, tuple) else (found,):
            if isinstance(number, float) and (math.isnan(number) or (math.isinf(number) and entry.high != math.inf)):
                raise Finding(f"{node}.{name} = {number} was accepted")


@cache
def _decoder() -> MessageDecoder:
    return MessageDecoder("/odom", TYPES["odom"], definition(TYPES["odom"]))


def message(data: bytes) -> bool:
    """A serialised message, one by one and in columns."""
    decoder = copy.copy(_decoder())
    decoder._layouts = {}
    one = _decided(lambda: decoder.deserialize(data))
    many = _decided(lambda: decoder.columns(data, np.array([0]), np.array([len(data)]), decoder.fields))
    return one is not None and many is not None


def scenario(data: bytes) -> bool:
    """A ROS parameters file."""
    found = _decided(lambda: parse_scenario(data.decode(errors="replace"), "fuzz"))
    if found is not None:
        for node in ("vessel_sim", "reference_ship", "controller"):
            _in_range(node, schema.flatten(getattr(found, node)))
    return found is not None


def parameters(data: bytes) -> bool:
    """Changes on the command line."""
    from vessel_hsmc_ros.cli.options import parse_changes

    lines = data.decode(errors="replace").split("\n")
    text = read_text(share_directory() / "config" / "case2_tracking.yaml")
    return (
        _decided(lambda: parse_scenario(text, "fuzz", parse_changes([line for line in lines if line and line[0] != "@"])))
        is not None
    )


def suite(data: bytes) -> bool:
    """A suite."""
    return _decided(lambda: load_suite(_file(data, "suite.yaml"))) is not None


def campaign(data: bytes) -> bool:
    """A campaign file."""
    text = read_text(share_directory() / "config" / "case2_tracking.yaml")
    source = Source("fuzz", data.decode(errors="replace"), "case2_tracking", text)
    return _decided(lambda: parse_campaign(source)) is not None


def vessel(data: bytes) -> bool:
    """A vessel file."""
    return _decided(lambda: read_vessel(str(_file(data, "vessel.yaml")))) is not None


def csv(data: bytes) -> bool:
    """Measurements as CSV."""
    return _decided(lambda: from_csv(_file(data, "run.csv"))) is not None


def waypoints(data: bytes) -> bool:
    """Waypoints as CSV, or as YAML."""
    found = [_decided(lambda name=name: read_waypoints(_file(data, name))) for name in ("path.csv", "path.yaml")]  # type: ignore[misc]
    for points in found:
        if points is not None and not all(math.isfinite(number) for point in points for number in point):  # type: ignore[attr-defined]
            raise Finding("a waypoint that is not finite was accepted")
    return any(points is not None for points in found)


def bag(data: bytes) -> bool:
    """An MCAP file: its columns, its messages, its run, its scenario."""
    path = _file(data, "run.mcap")

    def read() -> bool:
        opened = open_bag(path)
        uses = (opened.load, lambda: list(opened.messages()), lambda: opened.run(VesselParameters().coefficients()))
        others = (lambda: opened.scenario(), opened.events, opened.diagnostics, lambda: opened.recording)
        for use in others:
            _decided(use)
        found = [_decided(lambda use=use: (use(), True)) for use in uses]  # type: ignore[misc]
        return None not in found

    return bool(_decided(read))


def unchecked_bag(data: bytes) -> bool:
    """An MCAP file without compression and checksums, so that mutations reach the readers of records and messages."""
    return bag(data)


def _without_checksums(path: Path) -> bytes:
    """The messages of a bag in a file without compression and checksums."""
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.NONE, enable_crcs=False)
    writer.start("ros2")
    opened, channels = open_bag(path), {}
    for name, series in opened.topics.items():
        schema = writer.register_schema(series.type, "ros2msg", series.definition.encode())
        channels[name] = writer.register_channel(name, "cdr", schema, {"offered_qos_profiles": "[]"})
    writer.add_metadata("rosbag2", {"serialized_metadata": "{}"})
    writer.add_attachment(0, 0, "parameters.yaml", "text/yaml", b"{}")
    for number, raw in enumerate(opened.raw_messages()):
        writer.add_message(channels[raw.topic], raw.log_time, raw.data, raw.publish_time, number)
    writer.finish()
    return stream.getvalue()


def metadata(data: bytes) -> bool:
    """A bag's metadata.yaml."""
    folder = _folder() / "bag"
    if not folder.exists():
        write_run(folder, 30)
    (folder / "metadata.yaml").write_bytes(data)
    return _decided(lambda: open_bag(folder).recording) is not None


@cache
def seeds() -> dict[str, bytes]:
    """A valid input for each target."""
    config = share_directory() / "config"
    made = _folder() / "seed"
    write_run(made, 30)
    opened = open_bag(made)
    rows = "".join(f"{0.1 * i},{0.2 * i},0.0,0.0,2.0,0.0,0.0,{100.0 * (i % 7)},0.0\n" for i in range(60))
    changes = "controller.law=guided\nvessel_sim.duration=10.0\nreference_ship.circle.speed=1\nvessel_sim.vessel.wind=3e6\n"
    return {
        "message": next(opened.raw_messages("odom")).data,
        "scenario": (config / "case2_tracking.yaml").read_bytes(),
        "parameters": changes.encode(),
        "suite": (config / "suites" / "guided.yaml").read_bytes(),
        "campaign": (config / "campaigns" / "environment.yaml").read_bytes(),
        "vessel": (config / "vessels" / "otter.yaml").read_bytes(),
        "csv": ("time,x,y,heading,u,v,r,surge_force,yaw_moment\n" + rows).encode(),
        "waypoints": b"x,y,heading\n0,0,0\n10.5,2,0.1\n20,3\n",
        "bag": next(made.glob("*.mcap")).read_bytes(),
        "unchecked_bag": _without_checksums(made),
        "metadata": (made / "metadata.yaml").read_bytes(),
    }


TARGETS: dict[str, Callable[[bytes], bool]] = {
    function.__name__: function
    for function in (message, scenario, parameters, suite, campaign, vessel, csv, waypoints, bag, unchecked_bag, metadata)
}
