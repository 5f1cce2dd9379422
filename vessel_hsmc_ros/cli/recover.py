"""`vessel-hsmc recover`: restore the index and the metadata of a truncated bag."""

from pathlib import Path

import click

from vessel_hsmc_ros.cli.options import bag_argument
from vessel_hsmc_ros.core.exceptions import BagError


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
