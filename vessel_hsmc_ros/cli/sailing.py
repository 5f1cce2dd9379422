"""What the verbs that send a vessel somewhere have in common: the progress of the goal, and its end."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from vessel_hsmc_ros.cli.console import print_line, progress_bar
from vessel_hsmc_ros.core.exceptions import RunError

if TYPE_CHECKING:
    from vessel_hsmc_ros.nodes.remote import Progress, Result

detach_option = click.option("--detach", is_flag=True, help="Only send it, as a message, and do not wait for the end.")


def show_until_end(sail: Callable[[Callable[["Progress"], None]], "Result"]) -> None:
    """Show the progress of a goal until its end.

    `sail`: sends the goal, calls what it is given with each progress, and returns the result. Raises RunError if the vessel does
    not reach it.
    """
    farthest = 0.0
    with progress_bar("sailing", 100.0, "%") as update:

        def show(now: Any) -> None:
            nonlocal farthest
            farthest = max(farthest, now.distance)
            leg = f"leg {now.leg} of {now.legs}, " if now.legs > 1 else ""
            note = f"{leg}{now.distance:.0f} m, {now.speed:.1f} m/s, {now.time_left:.0f} s left"
            update(100.0 * (1.0 - now.distance / farthest) if farthest else 0.0, note=note)

        result = sail(show)
    if not result.reached:
        raise RunError(result.text)
    print_line(result.text)
