"""The cost of recording and of the live view for a lockstep run.

All configurations take turns; the steps of each second come from the plant's diagnostics. Other load on the machine can slow a
second down but never speed it up, so the fastest tenth of the seconds is the best estimate of a cost.

    python benchmarks/watching.py [--rounds 5]
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

from rich.console import Console
from rich.table import Table
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from vessel_hsmc_ros.nodes.runs.processes import NodeGroup, StatusListener, alone
from vessel_hsmc_ros.scenario.scenario import dump_scenario, for_nodes, load_scenario

DURATION = 100.0
PORT = 8765
LOOP = ("controller", "reference_ship", "vessel_sim")
SERVED = ("recorder", "live", "markers", *LOOP)
WATCHED = "recorded, live, client"
KINDS = {
    "no recorder": LOOP,
    "recorded": ("recorder", *LOOP),
    "recorded, live, no client": SERVED,
    WATCHED: SERVED,
}


def main() -> None:
    """Run all configurations in turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5, help="turns of each kind")
    parser.add_argument("--client", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.client:
        watch()
        return
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(Path(__file__).parents[1] / "config" / "fastdds.xml"))
    paces: dict[str, list[float]] = {kind: [] for kind in KINDS}
    processor: dict[str, list[float]] = {kind: [] for kind in KINDS}
    console = Console()
    with tempfile.TemporaryDirectory() as folder, console.status("measuring") as status:
        for turn in range(arguments.rounds):
            for number, kind in enumerate(KINDS):
                status.update(f"turn {turn + 1} of {arguments.rounds}: {kind}")
                began = processor_time()
                paces[kind] += pace(Path(folder) / f"{turn}_{number}", kind)
                processor[kind].append(processor_time() - began)
    console.print(table(paces, processor))


def table(paces: dict[str, list[float]], processor: dict[str, list[float]]) -> Table:
    """Lay out the pace of each configuration, and its additional time relative to the run without recorder."""
    found = Table(f"{DURATION:g} s of case 2", "seconds", "median steps/s", "fastest tenth", "processor time")
    first: tuple[float, ...] = ()
    for kind, pace_of in paces.items():
        median, fast, used = statistics.median(pace_of), statistics.quantiles(pace_of, n=10)[-1], min(processor[kind])
        first = first or (median, fast, used)
        more = [100.0 * (share - 1.0) for share in (first[0] / median, first[1] / fast, used / first[2])]
        values = (f"{median:.0f}", f"{fast:.0f}", f"{used:.2f} s")
        found.add_row(kind, str(len(pace_of)), *(f"{f} ({m:+.0f} %)" for f, m in zip(values, more, strict=True)))
    found.caption = "In brackets: additional time relative to no recorder. The client takes every topic."
    return found


def processor_time() -> float:
    """Return the processor time of all child processes that have ended, in seconds."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def pace(folder: Path, kind: str) -> list[float]:
    """Run one configuration and return its steps per second, for each second of the plant's diagnostics."""
    folder.mkdir()
    names = KINDS[kind]
    changes = for_nodes(recorded="recorder" in names, real_time=False) | {
        "vessel_sim.duration": DURATION,
        "recorder.directory": str(folder / "bag"),
    }
    parameters = folder / "params.yaml"
    parameters.write_text(dump_scenario(load_scenario("case2_tracking", changes)), encoding="utf-8")
    heard_at: dict[float, float] = {}
    client = subprocess.Popen([sys.executable, __file__, "--client"]) if kind == WATCHED else None
    with NodeGroup(parameters, folder / "logs", "", alone(names)) as nodes, StatusListener() as listener:
        while not nodes.ended():
            listener.listen(0.1)
            if (simulated := float(listener.status.get("vessel_sim", {}).get("simulated_time", 0.0))) > 0.0:
                heard_at.setdefault(simulated, listener.heard_at["vessel_sim"])
    if client is not None and client.wait(10.0):
        raise RuntimeError("the client received fewer than 100 messages")
    if (failed := nodes.failed()) is not None:
        raise RuntimeError(f"{failed.describe_exit()}, see {folder}/logs")
    points = list(heard_at.items())[:-1]  # the last diagnostics come after the end of the run
    return [100.0 * (b - a) / (t - s) for (a, s), (b, t) in pairwise(points)]


def watch() -> None:
    """Run the client: subscribe to every channel and discard the messages; the exit code is 1 if there were hardly any."""
    taken = 0
    protocols = [Subprotocol("foxglove.sdk.v1"), Subprotocol("foxglove.websocket.v1")]
    connection = None
    while connection is None:
        try:
            connection = connect(f"ws://127.0.0.1:{PORT}", subprotocols=protocols, max_size=None)
        except OSError:
            time.sleep(0.05)
    try:
        for message in connection:
            if isinstance(message, str):
                for channel in json.loads(message).get("channels", ()):
                    pair = {"id": channel["id"], "channelId": channel["id"]}
                    connection.send(json.dumps({"op": "subscribe", "subscriptions": [pair]}))
            else:
                taken += 1
    except WebSocketException:
        pass
    sys.exit(taken < 100)


if __name__ == "__main__":
    main()
