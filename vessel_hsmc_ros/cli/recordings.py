"""The verbs that read recordings: `report`, `replay` and `recover`."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console

from vessel_hsmc_ros.cli.console import print_files, print_line, print_metrics, print_table, print_warning
from vessel_hsmc_ros.cli.options import (
    bag_argument,
    changes_option,
    file_option,
    interpreted_option,
    law_file_option,
    namespace_option,
    output_option,
    refuse_without,
    topic_options,
)
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import BagError, RunError
from vessel_hsmc_ros.core.hull import DrawnHull
from vessel_hsmc_ros.core.install_paths import missing_module
from vessel_hsmc_ros.core.node_list import PLANT, REFERENCE
from vessel_hsmc_ros.nodes.ros_environment import check_ros
from vessel_hsmc_ros.scenario.warnings import check_effects

if TYPE_CHECKING:  # what reads bags takes a while to import
    from vessel_hsmc_ros.bags.reader import Bag
    from vessel_hsmc_ros.scenario.scenario import Scenario


@click.command()
@click.argument("bags", nargs=-1, required=True, metavar="RUN...", type=click.Path(path_type=Path))
@file_option("Path of the page [default: report.html in the run folder].")
@click.option("--title", help="Title of the page.")
@namespace_option
@topic_options
@click.option("--figures", type=click.Choice(["png", "svg"]), help="Also save the figures, in figures/ beside the page.")
@click.option("--csv", is_flag=True, help="Also export all signals as CSV, into csv/ beside the page.")
@click.option("--parquet", is_flag=True, help="Also export all signals as Parquet, if pyarrow is installed.")
@click.option("--hull-length", type=float, help="Length of the drawn hull, m [default: of the recorded ship].")
@click.option("--hull-beam", type=float, help="Beam of the drawn hull, m [default: of the recorded ship].")
def report(
    bags: tuple[Path, ...], hull_length: float | None, hull_beam: float | None, output: Path | None, **options: Any
) -> None:
    """Make a page with diagrams from recordings: run folders or bags.

    It shows the vessel on its track beside its reference, linked diagrams of all signals, metrics, parameters and versions.
    Several bags are overlaid, with a table of the differences from the first. The page of a bag outside a run folder is
    NAME_report.html beside it.
    """
    from vessel_hsmc_ros.report import rows  # imports the report's libraries
    from vessel_hsmc_ros.report.page import Options, make

    hull = schema.build(DrawnHull, {"length": hull_length or 0.0, "beam": hull_beam or 0.0}, "hull")
    made = make(bags, Options(page=output, hull=hull, **options))
    print_metrics([(record.name if len(made.records) > 1 else "", rows(record.metrics, record.facts)) for record in made.records])
    print_files(made.files)


@click.command()
@bag_argument
@click.option("--rate", type=click.FloatRange(0.001, 1000.0), help="Playback speed relative to real time [default: 1].")
@click.option("--loop", is_flag=True, help="Restart at the end.")
@click.option("--paused", is_flag=True, help="Start paused, until the service /replay/pause is called with false.")
@click.option("--topic", "topics", multiple=True, help="Publish only this topic; may be given several times [default: all].")
@click.option("--verify", "verified", is_flag=True, help="Recompute every recorded command and compare it bit by bit.")
@changes_option("--set", "edits", "With --verify: recompute with a changed parameter.")
@changes_option("--with", "changes", "Simulate the scenario of the bag again with a changed parameter.")
@interpreted_option
@law_file_option
@namespace_option
@output_option
def replay(
    bag: Path,
    rate: float | None,
    loop: bool,
    paused: bool,
    topics: tuple[str, ...],
    verified: bool,
    edits: dict[str, object],
    changes: dict[str, object],
    namespace: str | None,
    output: Path,
) -> None:
    """Play a recording back, check it or repeat it.

    Without options the messages of BAG are published over ROS 2, at the pace at which they were recorded, with the simulated time
    on /clock. With --verify every command of the controller is computed again and compared with the recorded one. With --with the
    simulation is repeated with a changed parameter, and a page compares both runs. The last two need no ROS.
    """
    if bool(verified) + bool(changes) + bool(rate or loop or paused or topics) > 1:
        raise click.UsageError("--verify, --with and the options for publishing exclude each other")
    if edits and not verified:
        raise click.UsageError("--set goes with --verify; to rerun the scenario with a change use --with")
    if not changes:
        refuse_without("--with", "output")
    if not (verified or changes):
        refuse_without("--verify or --with; --topic selects what is published", "namespace")
    from vessel_hsmc_ros.bags.reader import open_bag

    opened = open_bag(bag)
    if verified:
        _verify(opened, edits, namespace)
    elif changes:
        _rerun(opened, changes, namespace, output)
    else:
        _publish(opened, rate or 1.0, loop, paused, topics)


def _verify(bag: Bag, edits: dict[str, object], namespace: str | None) -> None:
    from vessel_hsmc_ros.studies.verification import parameter_changes, verdict, verify, version_note

    scenario = _changed(bag, edits, namespace)
    for name in edits:
        if name.startswith((f"{PLANT}.", f"{REFERENCE}.")):
            print_warning(f"{name} has no effect with --verify, which recomputes the controller: use --with")
    with Console(stderr=True).status("recomputing every command"):
        result = verify(bag, scenario, namespace)
    for line in verdict(result):
        click.echo(line)
    if not len(result.differing):
        return
    if times := parameter_changes(bag, namespace):
        click.echo(f"the controller's parameters were changed during the recording, first at t = {times[0]:g} s")
    if not edits:
        click.echo(version_note(bag))
    sys.exit(1)


def _changed(bag: Bag, changes: dict[str, object], namespace: str | None) -> Scenario:
    """The scenario of a bag with changes, and a warning of each that has no effect."""
    scenario = bag.scenario(changes, namespace=bag.namespace(namespace))
    for line in check_effects(scenario, changes, given=()):
        print_warning(line)
    return scenario


def _rerun(bag: Bag, changes: dict[str, object], namespace: str | None, output: Path) -> None:
    from vessel_hsmc_ros.studies.verification import rerun

    _changed(bag, changes, namespace)
    with Console(stderr=True).status("running the scenario again"):
        made = rerun(bag, changes, namespace, output)
    print_table(["", "recorded", "again", "difference"], made.table, title=f"again with {made.change}")
    print_line(f"page: {made.folder.report}\nfigures: {made.folder.figures}")


def _publish(bag: Bag, rate: float, loop: bool, paused: bool, topics: tuple[str, ...]) -> None:
    """Publish a bag until its end or until a signal."""
    check_ros()
    try:
        import rclpy
        from rclpy.signals import SignalHandlerOptions

        from vessel_hsmc_ros.nodes.replay import Playing, ReplayNode
    except ModuleNotFoundError as error:
        raise RunError(missing_module(error)) from None
    received: list[int] = []  # numbers of signals; the replay ends at the first one
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda signum, _frame: received.append(signum))
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = ReplayNode(bag, Playing(rate, loop, paused, topics))
        click.echo(f"publishing {bag.path}" + (", paused: call /replay/pause with false" if paused else ""))
        node.play(lambda: not received)
        click.echo(f"published {node.published} messages, up to {node.position:g} s")
        node.destroy_node()
    finally:
        rclpy.shutdown(uninstall_handlers=False)


@click.command()
@bag_argument
def recover(bag: Path) -> None:
    """Repair a recording that was cut off or damaged.

    BAG is a run folder or the bag in it. It is repaired in place: index and metadata are restored, damaged parts are omitted.
    A complete and undamaged bag is left unchanged.
    """
    from vessel_hsmc_ros.bags.files import bag_path  # imports the MCAP library
    from vessel_hsmc_ros.bags.repair import repair

    bag = bag_path(bag)
    if not bag.is_dir():
        raise BagError(f"{bag} is not a bag folder")
    done = repair(bag)
    if not done.files and not done.described:
        click.echo(f"{bag} is complete: {done.messages} messages")
        return
    repairs = [f"{done.files} of its files completed" if done.files else "metadata.yaml rewritten"]
    if done.cut:
        repairs.append(f"{done.cut} bytes of an incomplete end removed")
    if done.damaged:
        repairs.append(f"{done.damaged} damaged parts omitted")
    click.echo(f"{bag}: {done.messages} messages can be read; {', '.join(repairs)}")
