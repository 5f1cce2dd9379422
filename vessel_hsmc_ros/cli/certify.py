"""`vessel-hsmc certify`: what holds of the hierarchical law near the reference, on the vessel of a scenario."""

import math
from collections.abc import Sequence
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_line, print_table
from vessel_hsmc_ros.cli.options import json_option, load_checked, parse_changes, print_json, scenario_argument, set_option
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.studies.certificate import BOX, Case, Limits, Part, at_a_point, case_of, limits_of, under_way

EXACT = 1e-6
"""Share of the length below which a bound counts as none."""


@click.command()
@scenario_argument
@set_option
@json_option
def certify(scenario: str, changes: Sequence[str], as_json: bool) -> None:
    """Print what holds near the reference for the hierarchical law on the vessel of SCENARIO, whose data may be wrong by 20 %.

    A bound of the position error under way and at rest in the wind, current and noise of the scenario, or the condition that
    fails; the dead time and the control rate that the law tolerates; and what no law can do with this vessel. docs/theory.md says
    what is proven.
    """
    loaded = load_checked(scenario, parse_changes(changes))
    case = case_of(loaded)
    parts = parts_of(case)
    limits = limits_of(case)
    if as_json:
        print_json({**{name: _content(part) for name, part in parts.items()}, "limits": limits._asdict()})
        return
    title = f"conditions, each above 1, with hull data to {100 * BOX:.0f} %"
    print_table(["", "condition", "value"], _conditions(parts), title=title, text_columns=2)
    show(parts, case.known.length)
    for line in [*_not_covered(loaded), *_in_words(case, limits)]:
        print_line(line)


def parts_of(case: Case) -> dict[str, Part]:
    """The certificates of the motions that a case has, by name."""
    return {**({"under way": under_way(case)} if case.speed > 0.0 else {}), "at rest": at_a_point(case)}


def show(parts: dict[str, Part], length: float) -> None:
    """Print a line on each part: its bound, or the condition that fails.

    Args:
        parts: The parts by name.
        length: Of the hull, m.
    """
    for name, part in parts.items():
        if part.failed:
            print_line(f"no certificate of the hierarchical law {name}: {part.failed[0]}")
            continue
        exact = part.bound < EXACT * length
        kept = "leaves no position error" if exact else f"keeps the position within {quantity(part.bound, 'm')}"
        times = f"time constant at most {quantity(part.settling, 's')}"
        if part.current_settling > part.settling:
            times += f", in a turn {quantity(part.current_settling, 's')} of the estimated current"
        print_line(f"the hierarchical law {name} {kept} in the end; {times}")


def _conditions(parts: dict[str, Part]) -> list[list[str]]:
    """A row for each condition."""
    return [
        [name, each.name, f"{each.ratio.low:.3g} to {each.ratio.high:.3g}"]
        for name, part in parts.items()
        for each in part.clauses
    ]


def _content(part: Part) -> dict[str, Any]:
    """A part for programs."""
    clauses = {each.name: {"low": each.ratio.low, "high": each.ratio.high, "holds": each.holds} for each in part.clauses}
    return {"bound": part.bound, "settling": part.settling, "current_settling": part.current_settling, "conditions": clauses}


def _not_covered(scenario: Scenario) -> list[str]:
    """What acts in the scenario and is not in the bounds."""
    sim, present = scenario.vessel_sim, []
    if scenario.controller.observer.enabled:
        present.append("the noise that the observer leaves")
    if sim.disturbance.waves.significant_height:
        present.append("the waves")
    if not math.isinf(min(sim.actuators.surge_force_rate, sim.actuators.yaw_moment_rate)) or sim.actuators.kind == "thrusters":
        present.append("the rates of the actuators")
    return [f"the bounds do not cover {' and '.join(present)}"] if present else []


def _in_words(case: Case, limits: Limits) -> list[str]:
    """What the law tolerates, and what no law can do."""
    used, lines = max(each.lag + each.dead_time for each in case.lags), [f"lowest control rate: {quantity(limits.rate, 'Hz')}"]
    if not math.isnan(limits.dead_time):
        most = quantity(used + limits.dead_time, "s")
        lines.append(f"largest lag and dead time together: {most}, of which the actuators use {quantity(used, 's')}")
    if case.speed:
        lines += [
            f"tightest turn at {quantity(case.speed, 'm/s')}: a radius of {quantity(limits.turn, 'm')}",
            f"no law keeps a leg at this speed in a current across of more than {quantity(limits.current, 'm/s')}",
        ]
    if limits.circle:
        circle = quantity(limits.circle, "m")
        lines.append(f"no law at rest stays within a radius of {circle} under the sway force that is fixed to the hull")
    return lines
