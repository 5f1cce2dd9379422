"""`vessel-hsmc replay`: a bag published again, its commands computed again, or its scenario run again with a change."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.cli.options import parse_changes
from vessel_hsmc_ros.core.exceptions import RunError

if TYPE_CHECKING:  # what reads bags takes a while to load
    from vessel_hsmc_ros.bags.reader import Bag
    from vessel_hsmc_ros.runs.verification import Verification

PLAIN: Any = {"markup": False, "highlight": False, "soft_wrap": True}
AXES = (("surge force", "N"), ("yaw moment", "N·m"))


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--rate", type=click.FloatRange(0.001, 1000.0), help="Recorded seconds in a second [default: 1].")
@click.option("--loop", is_flag=True, help="Begin again at the end.")
@click.option("--paused", is_flag=True, help="Wait at the start until the service /replay/pause is told false.")
@click.option("--topic", "topics", multiple=True, help="Publish this topic; may be given several times [default: all].")
@click.option("--verify", "checked", is_flag=True, help="Compute every recorded command again and compare it bit for bit.")
@click.option("--set", "edits", multiple=True, metavar="NODE.PARAM=VALUE", help="With --verify: another parameter.")
@click.option("--with", "changes", multiple=True, metavar="NODE.PARAM=VALUE", help="Run the bag's scenario again with a change.")
@click.option("--namespace", help="The vessel's ROS namespace, where a bag holds several.")
@click.option(
    "--output", type=click.Path(path_type=Path), default=Path("runs"), show_default=True, help="With --with: run folders."
)
def replay(
    bag: Path,
    rate: float | None,
    loop: bool,
    paused: bool,
    topics: tuple[str, ...],
    checked: bool,
    edits: tuple[str, ...],
    changes: tuple[str, ...],
    namespace: str | None,
    output: Path,
) -> None:
    """Publish BAG again over ROS 2 with its /clock; or, with --verify or --with, compute it again without ROS."""
    if bool(checked) + bool(changes) + bool(rate or loop or paused or topics) > 1:
        raise click.UsageError("--verify, --with and the options for publishing exclude each other")
    if edits and not checked:
        raise click.UsageError("--set goes with --verify; to run the scenario with a change there is --with")
    from vessel_hsmc_ros.bags.reader import open_bag

    opened = open_bag(bag)
    if checked:
        _verify(opened, edits, namespace)
    elif changes:
        _rerun(opened, changes, namespace, output)
    else:
        _publish(opened, rate or 1.0, loop, paused, topics)


def _verify(bag: Bag, edits: tuple[str, ...], namespace: str | None) -> None:
    from vessel_hsmc_ros.runs.verification import retuned_at, verify

    scenario = bag.scenario(parse_changes(edits))
    console = Console(stderr=True)
    with console.status("computing every command again"):
        found = verify(bag, scenario, namespace)
    for line in verdict(found):
        click.echo(line)
    if len(found.differing) and (times := retuned_at(bag, namespace)):
        click.echo(f"the controller's parameters were changed while it was recorded, first at t = {times[0]:g} s")
    sys.exit(1 if len(found.differing) else 0)


def verdict(found: Verification) -> list[str]:
    """What came of a verification, line by line."""
    count = len(found.time)
    surge, yaw = found.largest
    lines = [f"{count} commands over {found.time[-1]:g} s: max |delta tau| = {surge:g} N, {yaw:g} N·m"]
    if not len(found.differing):
        lines.append("every command is the same to the last bit")
    else:
        first = int(found.differing[0])
        pairs = zip(AXES, found.recorded[first].tolist(), found.computed[first].tolist(), strict=True)
        told = ", ".join(f"{name} {old!r} {unit} recorded and {new!r} {unit} now" for (name, unit), old, new in pairs)
        lines.append(f"{len(found.differing)} commands differ, the first at t = {found.time[first]:g} s: {told}")
    if found.beyond:
        lines.append(f"{found.beyond} odometry messages come after the last whose command and reference are in the bag")
    return lines


def _rerun(bag: Bag, changes: tuple[str, ...], namespace: str | None, output: Path) -> None:
    from vessel_hsmc_ros.runs.rerun import rerun

    with Console(stderr=True).status("running the scenario again"):
        made = rerun(bag, parse_changes(changes, "--with"), namespace, output)
    table = Table(title=f"again with {made.change}", title_justify="left")
    for name in ("", "recorded", "again", "difference"):
        table.add_column(name, justify="right" if name else "left", no_wrap=not name)
    for line in made.table:
        table.add_row(*line)
    out = Console()
    out.print(table)
    out.print(f"page: {made.folder.report}\nfigures: {made.folder.figures}", **PLAIN)


def _publish(bag: Bag, rate: float, loop: bool, paused: bool, topics: tuple[str, ...]) -> None:
    """Until the end, or until the user has had enough."""
    try:
        import rclpy
        from rclpy.signals import SignalHandlerOptions

        from vessel_hsmc_ros.nodes.replay import Playing, ReplayNode
    except ModuleNotFoundError as error:
        raise RunError(f"{error.name} is not installed: publishing needs ROS 2, --verify and --with do without") from None
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _frame: stopped.append(received))
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = ReplayNode(bag, Playing(rate, loop, paused, topics))
        click.echo(f"publishing {bag.path}" + (", paused: call /replay/pause with false" if paused else ""))
        node.play(lambda: not stopped)
        click.echo(f"published {node.published} messages, up to {node.position:g} s")
        node.destroy_node()
    finally:
        rclpy.shutdown()
