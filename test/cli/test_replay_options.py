"""`vessel-hsmc replay`: what its options for publishing do."""

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from bag_making import write_run
from click.testing import CliRunner
from durations import rest_long

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario
from vessel_hsmc_ros.studies import verification

nodes = pytest.importorskip("vessel_hsmc_ros.nodes.replay", reason="ROS is not installed")

LOOKS = 3
"""Of a replay that has published nothing: it is paused."""


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """The handlers of signals are afterwards those of before."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize(("options", "rounds"), [((), 1), (("--loop",), 2), (("--paused",), 0), (("--paused", "--loop"), 0)])
def test_a_replay_begins_again_with_loop_and_waits_with_paused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], rounds: int
) -> None:
    write_run(tmp_path / "bag", 5)
    count = open_bag(tmp_path / "bag").count
    play, published = nodes.ReplayNode.play, []

    def bounded(node: Any, running: Callable[[], bool]) -> None:
        looks = iter(range(LOOKS))
        play(node, lambda: node.published < 2 * count and bool(node.published or not node.paused or next(looks, -1) >= 0))
        published.append(node.published)

    monkeypatch.setattr(nodes.ReplayNode, "play", bounded)
    arguments = ["replay", str(tmp_path / "bag"), "--rate", "1000", *options]
    output = CliRunner().invoke(cli, arguments, catch_exceptions=False, standalone_mode=False).output
    assert published == [rounds * count]
    assert ("paused: call /replay/pause with false" in output) == ("--paused" in options)


@pytest.mark.parametrize(
    ("options", "warning"),
    rest_long(
        [
            (("--verify", "--set", "controller.los_pid.integral_gain=0.3"), "no effect: controller.law is not los_pid"),
            (("--with", "controller.los_pid.integral_gain=0.3"), "no effect: controller.law is not los_pid"),
            (
                ("--verify", "--set", "vessel_sim.vessel.surge_inertia=2e5"),
                "no effect with --verify, which recomputes the controller",
            ),
            (("--with", "vessel_sim.vessel.surge_inertia=2e5"), ""),
            (("--verify", "--set", "controller.guided.position_gain=0.3"), ""),
            (("--verify",), ""),
        ],
        3,
    ),
)
def test_a_change_without_an_effect_has_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], warning: str
) -> None:
    def ends(*_: Any) -> None:
        raise BagError("the work itself")

    write_run(tmp_path / "bag", 5)
    (tmp_path / "params.yaml").write_text(dump_scenario(load_scenario("case2_tracking", {"controller.law": "guided"})))
    monkeypatch.setattr(verification, "verify", ends)
    monkeypatch.setattr(verification, "rerun", ends)
    result = CliRunner().invoke(cli, ["replay", str(tmp_path / "bag"), *options], standalone_mode=False)
    assert str(result.exception) == "the work itself"
    assert warning in result.stderr
    assert ("warning" in result.stderr) == bool(warning)
