"""Which ships of a campaign with the family of ships are lost, and why: `python benchmarks/ship_family/ship_findings.py FOLDER`.

`vessel-hsmc campaign strangers` computes such a campaign, and its report counts the lost ships. This distinguishes them: by what
their owners declare, by their delays, loads, sensors and sizes; and it judges the judgement of what is feasible.
"""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import rich
from numpy.typing import NDArray
from rich.table import Table
from ship_family import ShipFamily

from vessel_hsmc_ros.studies.campaign.distributions import SHIP
from vessel_hsmc_ros.studies.campaign.plan import Campaign
from vessel_hsmc_ros.studies.campaign.results import Results, clopper_pearson, interval_text, read, share_text


def main() -> None:
    """Print the sentences and the table of a campaign."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the campaign")
    ships = ships_of(read(parser.parse_args().folder))
    for sentence in (*because(ships), wrong(ships)):
        rich.print(sentence)
    head, lines = lost(ships)
    table = Table(*head)
    for line in lines:
        table.add_row(*line)
    rich.print(table)


Mask = NDArray[np.bool_]
Column = NDArray[Any]

KNOWLEDGE = f"{SHIP}knowledge"


@dataclass(frozen=True)
class Ships:
    """The ships of a campaign with the family, of the draws of which all variants are computed.

    A ship is lost if its run fails: it ends early, or exceeds a limit. Only feasible ones count, those that a law with exact
    knowledge can keep. All variants of a draw share the ship and its day, so they are compared ship by ship.
    """

    campaign: Campaign
    values: Mapping[str, Column]  # the numbers of the ships that are drawn, (n,) each, by their names without prefix
    feasible: Mask  # whether a law can keep each ship, (n,)
    lost: Mapping[str, Mask]  # whether it is lost, (n,), for each variant


def ships_of(results: Results) -> Ships:
    """The ships of a campaign."""
    found = results.by_variant
    common = reduce(np.intersect1d, (runs.rows["draw"] for runs in found.values()))
    chosen = {variant: np.isin(runs.rows["draw"], common) for variant, runs in found.items()}
    first = next(iter(found))
    rows = {name: column[chosen[first]] for name, column in found[first].rows.items()}
    values = {name.removeprefix(SHIP): rows[name] for name in results.campaign.drawn if name.startswith(SHIP)}
    lost = {variant: runs.failed[chosen[variant]] for variant, runs in found.items()}
    return Ships(results.campaign, values, rows["infeasible"] == "", lost)


def because(ships: Ships) -> list[str]:
    """How many ships are lost because of what is declared of them."""
    named = _by_knowledge(ships.campaign)
    if not {"declared", "nothing"} <= named.keys():
        return []
    lost = {knowledge: ships.lost[variant] & ships.feasible for knowledge, variant in named.items() if variant in ships.lost}
    n, kept = int(ships.feasible.sum()), ships.feasible & ~lost["nothing"]
    because = kept & lost["declared"]
    lines = [f"Because of what was declared {_share(int(because.sum()), n, ships.campaign, counted=True)} are lost."]
    if "true_values" in lost:
        still, true = int((because & lost["true_values"]).sum()), int((kept & lost["true_values"]).sum())
        lines.append(
            f"Of these, {still} are lost with the true values as well; in all, true values lose"
            f" {_share(true, n, ships.campaign, counted=True)} that are kept with nothing declared."
        )
    return lines


def wrong(ships: Ships) -> str:
    """The cost of a wrong judgement of what is feasible."""
    none = reduce(np.logical_and, ships.lost.values())
    return (
        f"Of {int((~ships.feasible).sum())} infeasible ships some variant keeps {int((~none & ~ships.feasible).sum())};"
        f" of {int(ships.feasible.sum())} feasible ones no variant keeps {int((none & ships.feasible).sum())}."
    )


def _by_knowledge(campaign: Campaign) -> dict[str, str]:
    """The first variant with each knowledge of the first law."""
    default = ShipFamily().knowledge
    found: dict[str, str] = {}
    for (variant, changes), law in zip(campaign.variants.items(), campaign.laws, strict=True):
        if law == campaign.laws[0]:
            found.setdefault(str(changes.get(KNOWLEDGE, campaign.changes.get(KNOWLEDGE, default))), variant)
    return found


def lost(ships: Ships) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of the ships that each variant loses: in all, and by what distinguishes them."""
    every = ("all", np.full(len(ships.feasible), ""))
    groups = [every, *((name, of(ships.values)) for name, of in GROUPS.items() if _known(of, ships.values))]
    lines = []
    for name, labels in groups:
        for i, group in enumerate(dict.fromkeys(sorted(labels.tolist(), key=_order))):
            among = ships.feasible & (labels == group)
            n = int(among.sum())
            counts = [int((each & among).sum()) for each in ships.lost.values()]
            lines.append([name if i == 0 else "", str(group), f"{n}", *map(str, counts)])
    return ["ships", "", "feasible", *ships.lost], lines


def _order(label: str) -> tuple[float, str]:
    """What is not there first, then numbers by their size, then texts."""
    number = label.split(" ")[0]
    if label in ("none", "no"):
        return -1.0, label
    return (float(number), label) if number.replace(".", "").isdigit() else (float("inf"), label)


Values = Mapping[str, Column]


def _known(of: Callable[[Values], Column], values: Values) -> bool:
    """Whether the numbers that a group needs are drawn."""
    try:
        of(values)
    except KeyError:
        return False
    return True


def _names(values: Values, switches: Mapping[str, str], none: str) -> Column:
    """Which of several switches are on, in words."""
    columns = [np.where(values[name].astype(bool), f"{word}, ", "") for name, word in switches.items()]
    joined = [("".join(parts).removesuffix(", ") or none) for parts in zip(*columns, strict=True)]
    return np.array(joined)


def _classes(column: Column, bounds: tuple[float, ...], unit: str = "") -> Column:
    """The interval between bounds that each number is in, in words."""
    names = np.array([f"{low:g} to {high:g}{unit}" for low, high in pairwise(bounds)])
    return names[np.clip(np.searchsorted(bounds, column.astype(float), side="right") - 1, 0, len(names) - 1)]


DELAYS = {"declares_lag": "lag", "declares_rate": "rate", "declares_dead_time": "dead time"}

GROUPS: dict[str, Callable[[Values], Column]] = {
    "delays declared": lambda v: _names(v, DELAYS, "none"),
    "coupling declared": lambda v: _names(v, {"declares_coupling": "yes"}, "no"),
    "sway damping declared": lambda v: _names(v, {"declares_sway_damping": "yes"}, "no"),
    "delays": lambda v: _names(v, {"has_lag": "lag", "has_rate": "rate", "has_dead_time": "dead time"}, "none"),
    "reference": lambda v: v["reference"],
    "loads": lambda v: _names(v, {"has_current": "current", "has_wind": "wind"}, "none"),
    "sensors": lambda v: _names(v, {"noisy": "noise"}, "perfect"),
    "control rate": lambda v: np.array([f"{rate:g} Hz" for rate in v["control_rate_hz"]]),
    "length": lambda v: _classes(v["length"], (0.0, 3.0, 10.0, 30.0, 100.0, 1000.0), " m"),
    "m11/m22": lambda v: _classes(v["surge_to_sway_inertia"], (0.0, 0.7, 0.85, 1.0, 2.0)),
}
"""What distinguishes ships, as a label for each."""


def _share(count: int, n: int, campaign: Campaign, counted: bool = False) -> str:
    """A share of the feasible ships, with its interval where draws are independent."""
    if not n:
        return "none"
    share = f"{count} of {n}, {share_text(count / n)}" if counted else share_text(count / n)
    return f"{share} ({interval_text(clopper_pearson(count, n))} at 95 %)" if campaign.independent else share


if __name__ == "__main__":
    main()
