"""A run with scripted faults: how its nodes are connected with the relay, and what happens to their processes."""

import signal
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.node_list import RELAY
from vessel_hsmc_ros.faults.fault import THRUSTERS, FaultScript
from vessel_hsmc_ros.messages.topics import RELAYED
from vessel_hsmc_ros.nodes.fault_sources import clock_topic, stepped_nodes
from vessel_hsmc_ros.runs.processes import NodeGroup
from vessel_hsmc_ros.scenario.fault_script import dump_script
from vessel_hsmc_ros.scenario.faults import relayed_topics
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.scenario.watcher_parameters import FaultRelayParameters


@dataclass(frozen=True)
class Injection:
    """The faults of a run.

    Attributes:
        script: The faults.
        scenario: The scenario in which they are carried out.
    """

    script: FaultScript
    scenario: Scenario

    def relayed(self, scenario: Scenario) -> Scenario:
        """The scenario as its nodes run it: they record what is relayed, and in lockstep answer every step."""
        topics = (*scenario.recorder.topics, *(f"{RELAYED}{topic}" for topic in relayed_topics(scenario)))
        made = replace(scenario, recorder=replace(scenario.recorder, topics=topics))
        names = [f"{node}.ride_through" for node, cls in NODES.items() if "ride_through" in schema.entries(cls)]
        return made.changed(dict.fromkeys(names, True)) if names and scenario.controller.lockstep else made

    def write(self, folder: Path) -> Path:
        """Write the script, and the parameters of the relay; returns the path of the parameters."""
        script = folder / "faults.yaml"
        script.write_text(dump_script(self.script), encoding="utf-8")
        sim = self.scenario.vessel_sim
        parameters = FaultRelayParameters(
            lockstep=sim.lockstep,
            recorded=sim.recorded,
            frame_prefix=sim.frame_prefix,
            script=str(script.absolute()),
            topics=relayed_topics(self.scenario),
            rate_hz=sim.rate_hz,
        )
        values = {name: list(v) if isinstance(v, tuple) else v for name, v in schema.flatten(parameters).items()}
        path = folder / "logs" / f"{RELAY}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(yaml.safe_dump({f"/**/{RELAY}": {"ros__parameters": values}}), encoding="utf-8")
        return path

    def arguments(self) -> dict[str, list[str]]:
        """Further ROS arguments of each node: what it receives comes through the relay."""
        names = {node: _remapped(node, relayed_topics(self.scenario)) for node in NODES}
        found = {node: [part for pair in pairs for part in ("-r", pair)] for node, pairs in names.items()}
        for node in stepped_nodes(self.script, self.scenario.vessel_sim.by_thrusters):
            found[node] += ["-r", f"/clock:={clock_topic(node)}", "-p", "use_sim_time:=true"]
        return found


def _remapped(node: str, topics: Sequence[str]) -> list[str]:
    """The remapping rules by which a node receives relayed messages, and by which it finds its partners in the handshake."""
    demands = [topic for topic in topics if topic.startswith(THRUSTERS)]
    received = {
        "vessel_sim": [*demands, "cmd_wrench"],
        "controller": ["odom", "reference"],
        "thruster_allocation": ["cmd_wrench", "odom"],
        # It waits for the node that reads its reference and publishes the wrench, which is the relay.
        "reference_ship": ["cmd_wrench"],
    }
    rules = [f"{topic}:={RELAYED}{topic}" for topic in received.get(node, [])]
    # With rudders the plant waits for the allocation to read its odometry, which the relay reads in its place.
    return [*rules, f"allocated_wrench:={RELAYED}odom"] if node == "vessel_sim" and demands else rules


class ProcessFaults:
    """Carries out the faults of processes, when the relay reports that they begin and end.

    Args:
        script: The faults.
        nodes: The processes of the run.

    Attributes:
        affected: The nodes that are absent because a fault demands it.
        restarted: The nodes started again, which may not have come up yet when the run ends.
    """

    def __init__(self, script: FaultScript, nodes: NodeGroup) -> None:
        self._nodes = nodes
        faults = [fault for fault in script.faults if fault.kind in ("kill", "stop", "restart")]
        self._begin = {f"{fault.describe()} begins": fault for fault in faults}
        self._end = {f"{fault.describe()} ends": fault for fault in faults}
        self.affected: set[str] = set()
        self.restarted: set[str] = set()

    def on_event(self, text: str) -> str:
        """Carry out what an event announces; returns the name of a node that is back, empty if none is."""
        if fault := self._begin.get(text):
            self.affected.add(fault.node)
            self._nodes.send_signal(fault.node, signal.SIGSTOP if fault.kind == "stop" else signal.SIGKILL)
        elif (fault := self._end.get(text)) and fault.kind != "kill":
            self.affected.discard(fault.node)
            if fault.kind == "stop":
                self._nodes.send_signal(fault.node, signal.SIGCONT)
            else:
                self._nodes.restart(fault.node)
                self.restarted.add(fault.node)
            return fault.node
        return ""
