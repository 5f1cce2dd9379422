"""How many drawn ships a law loses, for the numbers of the law that are given: the measure by which they are chosen.

The ships are those of the campaign `strangers`, drawn with a seed: numbers are chosen on some seeds and reported on another one
that took no part. A ship is lost whose rms position error over the last quarter exceeds the limit of the campaign; ships that
no law could keep are left out. `vessel-hsmc campaign strangers --seed SEED` computes the same with the law's defaults and keeps
the metrics of every run; this computes only the given variants, with the given numbers.

    python benchmarks/lost_ships.py [--seed 72] [--draws 150] [--variants guided "guided with nothing declared"]
        [--set controller.guided.surge_gain=4 ...]
"""

import argparse
from collections.abc import Iterator
from typing import NamedTuple

import yaml
from rich.console import Console
from rich.progress import track
from rich.table import Table

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.studies.batch import Outcome, simulate_many
from vessel_hsmc_ros.studies.campaign.distributions import ship_family
from vessel_hsmc_ros.studies.campaign.execute import exceeded
from vessel_hsmc_ros.studies.campaign.plan import Campaign

VARIANTS = "guided", "guided with nothing declared", "guided exactly declared"


class Ship(NamedTuple):
    """A drawn ship in one of the variants."""

    draw: int
    variant: str
    scenario: Scenario


def main() -> None:
    """Draw the ships, simulate them and print which are lost."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=72)
    parser.add_argument("--draws", type=int, default=150)
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), help="variants of the campaign")
    parser.add_argument("--set", nargs="*", default=[], metavar="NODE.PARAM=VALUE", help="numbers of the law")
    arguments = parser.parse_args()
    changes = {name: yaml.safe_load(value) for name, value in (each.split("=", 1) for each in arguments.set)}
    campaign = Campaign.load("strangers", arguments.draws, arguments.seed)
    unknown = set(arguments.variants) - set(campaign.variants)
    if unknown:
        parser.error(f"--variants must be any of {', '.join(campaign.variants)} (got {', '.join(unknown)})")
    console = Console(width=130)
    drawn = range(arguments.draws)
    of_draw = (ships_of(campaign, draw, arguments.variants, changes) for draw in track(drawn, "drawing", console=console))
    ships = [ship for each in of_draw for ship in each]
    outcomes: list[Outcome] = []
    with console.status("simulating") as status:

        def note(outcome: Outcome) -> None:
            outcomes.append(outcome)
            status.update(f"simulating: {len(outcomes)} of {len(ships)} runs")

        simulate_many((ship.scenario for ship in ships), workers=None, on_result=note)
    console.print(table(campaign, ships, sorted(outcomes, key=lambda outcome: outcome.index), arguments.variants))


def ships_of(campaign: Campaign, draw: int, variants: list[str], changes: dict[str, object]) -> Iterator[Ship]:
    """The variants of a drawn ship; none of one whose drawn values are not allowed, or which no law could keep."""
    names = list(campaign.variants)
    try:
        made = [(each, campaign.scenario(draw * len(names) + names.index(each), changes)) for each in variants]
    except (ParameterError, ScenarioError):
        return
    if not ship_family().infeasible(made[0][1]):
        yield from (Ship(draw, variant, scenario) for variant, scenario in made)


def table(campaign: Campaign, ships: list[Ship], outcomes: list[Outcome], variants: list[str]) -> Table:
    """How many ships of each variant are lost, and which."""
    found = Table("variant", "lost", "of", "draws")
    for variant in variants:
        of = [(ship, outcome) for ship, outcome in zip(ships, outcomes, strict=True) if ship.variant == variant]
        lost = [ship.draw for ship, outcome in of if is_lost(campaign, ship, outcome)]
        found.add_row(variant, f"{len(lost)}", f"{len(of)}", ", ".join(map(str, lost)))
    return found


def is_lost(campaign: Campaign, ship: Ship, outcome: Outcome) -> bool:
    """Whether a run ended early or exceeds the limits of the campaign."""
    return outcome.metrics is None or bool(exceeded(outcome.metrics, campaign.limits_of(ship.scenario)))


if __name__ == "__main__":
    main()
