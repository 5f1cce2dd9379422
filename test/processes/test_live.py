"""A client without ROS observes a run through the Foxglove WebSocket protocol without affecting it."""

import json
import signal
import socket
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from harness import BIN, Command
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.messages.topics import WATCHED_TOPICS
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

client = pytest.importorskip("websockets.sync.client")
pytest.importorskip("foxglove")

SUBPROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"]
MESSAGE, TIME = 1, 2
DURATION = 3600.0
"""Duration of the runs, s, longer than any test takes: the test interrupts a run when it has received what it checks."""

DEADLINE = 120.0


def free_port() -> Any:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def live_run(folder: Any, port: Any) -> Any:
    changes = ("--set", f"vessel_sim.duration={DURATION}")
    return Command(
        [BIN / "vessel-hsmc", "run", "case2_tracking", *changes, "--no-page", "--live", "--live-port", port], folder, {}
    )


def connect(port: Any, command: Any, end: Any) -> Any:
    while True:
        try:
            # A closing handshake would last until its time limit, because the test reads no message meanwhile.
            return client.connect(f"ws://127.0.0.1:{port}", subprotocols=SUBPROTOCOLS, close_timeout=0.1)
        except OSError:
            assert command.popen.poll() is None, f"the run ended before the live view was there:\n{command.text}"
            assert time.monotonic() < end, "the live view never listened"
            time.sleep(0.02)


def watch(connection: Any, wanted: Any, end: Any) -> Any:
    """The first message on each of the wanted topics, decoded with the schema that the server sent, and the times it expected."""
    channels, found, times = {}, {}, []
    while wanted - found.keys():
        assert time.monotonic() < end, f"nothing came on {wanted - found.keys()}"
        received = connection.recv(timeout=max(0.1, end - time.monotonic()))
        if isinstance(received, str):
            event = json.loads(received)
            for channel in event.get("channels", ()):
                if event["op"] == "advertise" and channel["topic"] in wanted:
                    channels[channel["id"]] = channel
                    pair = {"id": channel["id"], "channelId": channel["id"]}
                    connection.send(json.dumps({"op": "subscribe", "subscriptions": [pair]}))
        elif received[0] == TIME:
            times.append(*struct.unpack("<Q", received[1:]))
        elif received[0] == MESSAGE:
            subscription, stamp = struct.unpack_from("<IQ", received, 1)
            channel = channels[subscription]
            if channel["topic"] not in found:  # a client slower than the run falls ever further behind
                found[channel["topic"]] = stamp, decoded(channel, received[13:])
    return found, times


def decoded(channel: Any, data: Any) -> Any:
    assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(channel["schema"], channel["schemaName"]))
    return store.deserialize_cdr(data, channel["schemaName"])


@pytest.mark.long
def test_a_client_receives_decodable_messages_and_the_run_loses_nothing(tmp_path: Path) -> None:
    port = free_port()
    command = live_run(tmp_path, port)
    end = time.monotonic() + DEADLINE
    try:
        with connect(port, command, end) as connection:
            wanted = {"/odom", "/controller/state", "/diagnostics", "/markers", "/ship/path"}
            found, times = watch(connection, wanted, end)
        command.popen.send_signal(signal.SIGINT)
        assert command.wait(DEADLINE) == 128 + signal.SIGINT, command.text
    finally:
        command.kill()
    stamp, odometry = found["/odom"]
    assert stamp == odometry.header.stamp.sec * 10**9 + odometry.header.stamp.nanosec  # simulated time
    assert times == sorted(times)
    assert len(found["/markers"][1].markers[0].points) % 3 == 0

    bag = open_bag(next((tmp_path / "runs").iterdir()) / "bag")
    assert bag.recording["messages_dropped"] == "0"
    assert {name: series.type for name, series in bag.topics.items()}.items() <= {
        f"/{name.removeprefix('/')}": kind for name, kind in WATCHED_TOPICS.items()
    }.items()
    recorded = bag.run().state
    offline = simulate(load_scenario("case2_tracking", {"vessel_sim.duration": len(recorded) * 0.01})).state
    np.testing.assert_array_equal(recorded, offline[: len(recorded)])
    k = round(stamp / 1e7)
    assert odometry.pose.pose.position.x == recorded[k, 0]


def test_a_port_in_use_is_reported_before_the_run_begins(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        command = live_run(tmp_path, port)
        assert command.wait(DEADLINE) == 1
    assert f"the live view cannot listen on port {port}: Address already in use" in command.text
    assert not (tmp_path / "runs").exists()
