"""`vessel-hsmc recover`: give a bag that was cut off its index and metadata."""

from pathlib import Path

import click

from vessel_hsmc_ros.core.exceptions import BagError


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
def recover(bag: Path) -> None:
    """Complete BAG, in place: what its recorder could not finish, or what has been damaged since.

    A bag that is complete and undamaged is left as it is.
    """
    from vessel_hsmc_ros.bags.repair import repair  # takes a while to load

    if not bag.is_dir():
        raise BagError(f"{bag} is not a bag's folder")
    done = repair(bag)
    if not done.files and not done.described:
        click.echo(f"{bag} is complete: {done.messages} messages")
        return
    told = [f"{done.files} of its files completed" if done.files else "metadata.yaml written anew"]
    told += [f"{done.cut} bytes of an unfinished end cut off"] * bool(done.cut)
    told += [f"{done.damaged} damaged chunks left out"] * bool(done.damaged)
    click.echo(f"{bag}: {done.messages} messages can be read; {', '.join(told)}")
