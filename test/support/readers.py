"""Readers of other projects, each of which must read the recorded bags: serialised messages by topic."""

import shutil
import struct
import subprocess
from collections import defaultdict
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

ROOT = Path(__file__).parents[2]
NODE = ROOT / "build" / "node"
PACKAGES = ("@mcap/core", "@mcap/support", "@foxglove/rosmsg", "@foxglove/rosmsg2-serialization")
"""Installed into NODE by `make node-readers`."""

Found = dict[str, list[bytes]]


def files(directory: Path) -> list[Path]:
    """The MCAP files of a bag in order."""
    return sorted(directory.glob("*.mcap"), key=lambda path: int(path.stem.rsplit("_", 1)[1]))


def rosbags(directory: Path) -> Found:
    """PyPI's rosbags, which needs metadata.yaml and the end of each file."""
    found: Found = defaultdict(list)
    with AnyReader([directory]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            found[connection.topic].append(bytes(data))
    return found


def mcap_ros2_support(directory: Path) -> Found:
    """PyPI's mcap-ros2-support, which reads by the index."""
    found: Found = defaultdict(list)
    for path in files(directory):
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _, channel, message, _ in reader.iter_decoded_messages():
                found[channel.topic].append(message.data)
    return found


def mcap_stream(directory: Path) -> Found:
    """PyPI's mcap from front to back, up to where a file breaks off."""
    found: Found = defaultdict(list)
    for path in files(directory):
        with path.open("rb") as stream:
            try:
                for _, channel, message in NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False):
                    found[channel.topic].append(message.data)
            except (McapError, ValueError, struct.error):
                break
    return found


def mcap_core(directory: Path) -> Found:
    """npm's @mcap/core, which Foxglove and other programs in a browser use, by the index."""
    return _by_mcap_core(tuple(files(directory)))["indexed"]


def mcap_core_stream(directory: Path) -> Found:
    """npm's @mcap/core from front to back."""
    return _by_mcap_core(tuple(files(directory)))["stream"]


@cache
def _by_mcap_core(paths: tuple[Path, ...]) -> dict[str, Found]:
    done = subprocess.run(["node", node_program(), *paths], capture_output=True, text=True, timeout=60.0)
    assert done.returncode == 0, done.stderr
    found: dict[str, Found] = {"indexed": defaultdict(list), "stream": defaultdict(list)}
    for line in filter(None, done.stdout.split("\n")):
        how, topic, data = line.split(" ")
        found[how][topic].append(bytes.fromhex(data))
    return found


@cache
def node_program() -> Path:
    """The script beside its installed packages; skips the test if they are not installed."""
    if not shutil.which("node"):
        pytest.skip("Node.js is not installed: install it and run `make node-readers` to test @mcap/core")
    missing = [package for package in PACKAGES if not (NODE / "node_modules" / package).is_dir()]
    if missing:
        pytest.skip(f"{', '.join(missing)} not installed in build/node: `make node-readers` installs them")
    program = NODE / "read.mjs"
    program.write_text((ROOT / "test" / "support" / "read_with_mcap_core.mjs").read_text())
    return program


READERS: dict[str, Callable[[Path], Found]] = {
    "rosbags": rosbags,
    "mcap-ros2-support": mcap_ros2_support,
    "mcap stream": mcap_stream,
    "@mcap/core indexed": mcap_core,
    "@mcap/core stream": mcap_core_stream,
}
