"""The readers of other people that a bag must satisfy; each gives the bytes of a bag's messages by topic."""

import struct
import subprocess
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

ROOT = Path(__file__).parents[2]
NODE = ROOT / "build" / "node"
PACKAGES = ("@mcap/core@2.2.2", "@mcap/support@1.1.0", "@foxglove/rosmsg@5.0.5", "@foxglove/rosmsg2-serialization@3.1.0")


def files(directory):
    return sorted(directory.glob("*.mcap"), key=lambda path: int(path.stem.rsplit("_", 1)[1]))


def rosbags(directory):
    found = defaultdict(list)
    with AnyReader([directory]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            found[connection.topic].append(bytes(data))
    return found


def mcap_ros2_support(directory):
    found = defaultdict(list)
    for path in files(directory):
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _, channel, message, _ in reader.iter_decoded_messages():
                found[channel.topic].append(message.data)
    return found


def mcap_stream(directory):
    """What comes before the file breaks off, by a reader that does not look at its end."""
    found = defaultdict(list)
    for path in files(directory):
        with path.open("rb") as stream:
            try:
                for _, channel, message in NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False):
                    found[channel.topic].append(message.data)
            except (McapError, ValueError, struct.error):
                break
    return found


def mcap_core(directory):
    """npm's @mcap/core, that of Foxglove and other programs in a browser: by the index."""
    return _by_mcap_core(tuple(files(directory)))["indexed"]


def mcap_core_stream(directory):
    """The same package, from front to back."""
    return _by_mcap_core(tuple(files(directory)))["stream"]


@cache
def _by_mcap_core(paths):
    done = subprocess.run(["node", node_program(), *paths], capture_output=True, text=True, timeout=60.0)
    assert done.returncode == 0, done.stderr
    found = {"indexed": defaultdict(list), "stream": defaultdict(list)}
    for line in filter(None, done.stdout.split("\n")):
        how, topic, data = line.split(" ")
        found[how][topic].append(bytes.fromhex(data))
    return found


@cache
def node_program():
    """The script beside an installation of its packages in the build folder; a skip where there is none and can be none."""
    if not all((NODE / "node_modules" / package.rpartition("@")[0]).is_dir() for package in PACKAGES):
        NODE.mkdir(parents=True, exist_ok=True)
        command = ["npm", "install", "--no-audit", "--no-fund", "--silent", "--prefix", NODE, *PACKAGES]
        try:
            subprocess.run(command, check=True, capture_output=True, timeout=120.0)
        except FileNotFoundError:
            pytest.skip("Node is not installed: @mcap/core cannot be tried")
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
            pytest.skip("npm cannot install @mcap/core here: it cannot be tried")
    program = NODE / "read.mjs"
    program.write_text((ROOT / "test" / "support" / "read_with_mcap_core.mjs").read_text())
    return program


READERS = {
    "rosbags": rosbags,
    "mcap-ros2-support": mcap_ros2_support,
    "mcap stream": mcap_stream,
    "@mcap/core indexed": mcap_core,
    "@mcap/core stream": mcap_core_stream,
}
