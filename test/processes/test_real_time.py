"""Real time: the pace of the clock, and two vessels side by side.

All by the guided law: a machine that has other work too is late now and then, and two steps late the paper's law is unstable.
"""

import json
from typing import Any

import numpy as np
import pytest
from harness import run_folder

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.metrics import position_error
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

SHIP = VesselParameters().coefficients()


def begin(start: Any, duration: float, *arguments: str) -> Any:
    settings = ("--set", "controller.law=guided", "--set", f"vessel_sim.duration={duration}")
    return start("vessel-hsmc", "run", "case2_tracking", "--real-time", *settings, *arguments)


def folder_of(command: Any) -> Any:
    return run_folder(command.output.parent / "runs")


def finish(command: Any, deadline: float) -> tuple[Any, Any]:
    assert command.wait(deadline) == 0, command.text
    folder = folder_of(command)
    return open_bag(folder / "bag"), json.loads((folder / "run.json").read_text())


def test_a_real_time_run_is_complete_and_follows_the_lockstep_run(start: Any) -> None:
    """Its pace is measured by benchmarks/real_time.py: a busy machine makes it late."""
    command = begin(start, 3)
    bag, summary = finish(command, 120.0)
    run = bag.run(SHIP)
    assert summary["mode"] == "real time"
    assert summary["messages_dropped"] == 0
    np.testing.assert_allclose(np.diff(run.time), 0.01, atol=1e-9)
    assert len(run.time) == 301
    assert "/clock" not in bag.topics
    log = (folder_of(command) / "logs" / "controller.log").read_text()
    assert "law guided at 100 Hz; real time" in log
    assert "[ERROR]" not in log  # its end is none
    assert "[FATAL]" not in log
    offline = simulate(load_scenario("case2_tracking", {"controller.law": "guided", "vessel_sim.duration": 3.0}))
    distance, expected = (position_error(r.state, r.reference)[-1] for r in (run, offline))
    assert distance == pytest.approx(expected, rel=0.3)  # late steps differ from run to run
    folder = folder_of(command)
    assert (folder / "figures" / "jitter.png").read_bytes().startswith(b"\x89PNG")
    assert 'id="jitter"' in (folder / "report.html").read_text(encoding="utf-8")


@pytest.mark.alone  # ten processes start at once: beside other tests they would not find each other in time
def test_two_vessels_in_two_namespaces_do_not_disturb_each_other(start: Any) -> None:
    alpha = begin(start, 2, "--no-page", "--namespace", "alpha")
    beta = begin(
        start, 2, "--no-page", "--namespace", "fleet/beta", "--set", "vessel_sim.initial_pose=[500.0, 0.0, 0.0]",
        "--set", "reference_ship.initial_pose=[510.0, 0.0, 0.0]", "--set", "reference_ship.yaw_moment=-1e6",
    )  # fmt: skip
    for command, prefix, x in ((alpha, "/alpha/", 0.0), (beta, "/fleet/beta/", 500.0)):
        bag, summary = finish(command, 120.0)
        assert bag.topics.keys() == {
            *(prefix + topic for topic in ("odom", "cmd_wrench", "applied_wrench", "disturbance", "controller/state")),
            *(prefix + topic for topic in ("reference", "reference/pose", "dynamics/truth", "events")),
            *("/diagnostics", "/rosout", "/parameter_events"),
        }
        assert summary["messages_dropped"] == 0
        run = bag.run(SHIP)
        assert len(run.time) == 201
        assert np.all(np.abs(run.state[:, 0] - x) < 100.0)
        assert bag.diagnostics().keys() == {"vessel_sim", "controller", "reference_ship", "recorder"}
        # Whether the ship gets nearer depends on the pace of the machine; whose reference it follows does not.
        centre = run.reference[:, :2].mean(axis=0)
        assert np.all(np.abs(centre - (x, 0.0)) < 100.0)
