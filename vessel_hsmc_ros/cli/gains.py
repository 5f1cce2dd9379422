"""`vessel-hsmc gains`: the gains of the law of a scenario, where those of `guided` come from, and the margins that they leave."""

import math
from collections.abc import Sequence
from operator import attrgetter
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_line, print_table, print_warning
from vessel_hsmc_ros.cli.options import json_option, load_checked, parse_changes, print_json, scenario_argument, set_option
from vessel_hsmc_ros.core.quantities import number, quantity
from vessel_hsmc_ros.core.schema import entries
from vessel_hsmc_ros.guided.parameters import GuidedParameters, by_hand_or_derived
from vessel_hsmc_ros.guided.rule import RULES, dynamics, unit_time
from vessel_hsmc_ros.runs.margins import Study, shortcomings, study
from vessel_hsmc_ros.scenario.scenario import Scenario

REASONS = {
    "position_gain": "close to the heading slope, below which heading and position stay separate loops",
    "approach_speed": "leaves speed to catch up with a reference",
    "integral_gain": "removes what a steady current leaves; slower than the position gain",
    "integral_limit": "a small part of the approach speed, so that it never leads",
    "heading_surface_slope": "as steep as the turn that the moment and its lag allow",
    "sway_share": "below 1 for every ship: a yaw rate that follows all of the sway is a loop with the gain m11/m22",
    "sway_bandwidth": "well below the bandwidth of the heading, where damping keeps the sway from following the turn",
    "turn_acceleration_share": "leaves moment for the disturbance; little where the moment is slow",
    "turn_rate_limit": "what the full moment sustains; less where the moment is slow to stop the turn",
    "command_bandwidth": "a few times the heading slope",
    "command_integral": "removes the error in following a ramp",
    "yaw_reaching_gain": "several times the heading slope, below what lag and dead time allow",
    "surge_reaching_gain": "several times the position gain, below what lag and dead time allow",
    "surge_learning_rate": "as fast as noise permits: the estimate enters the force unfiltered",
    "sway_learning_rate": "faster than the others: it enters the commanded yaw rate only",
    "yaw_learning_rate": "as fast as noise permits: the estimate enters the moment unfiltered",
    "forecast_bandwidth": "above the frequencies of references and disturbances, where it costs little phase",
    "position_filter": "averages noise; the prediction has no lag",
    "heading_filter": "averages noise; the prediction has no lag",
    "slew_time": "keeps noise from instant actuators; of others the rates are in the law's model",
    "station_keeping_lever": "a small part of the length: the radius of the turn in station keeping",
    "station_keeping_lever_time": "the yaw loop settles in it",
    "station_keeping_heading_gain": "slow, only in calm",
    "station_keeping_speed": "well below the speed of any reference",
    "station_keeping_disturbance": "well below the acceleration by the limits",
    "backing_distance": "beyond it turning round is quicker than going astern",
}
"""Why the number of a gain is what it is, in a line each; docs/guided.md has more."""


@click.command()
@scenario_argument
@set_option
@json_option
def gains(scenario: str, changes: Sequence[str], as_json: bool) -> None:
    """Print the gains of the law of SCENARIO, with the margins of its loops on the ship.

    A gain of the guided law that is not set by hand is computed from the ship's length L and from
    T = sqrt(yaw_inertia/yaw_moment_limit): the table names the factor and the powers of L and T. The margins are those of the
    law linearised about a straight path at the speed of the reference. A warning names each loop with a gain margin below 6 dB
    or a phase margin below 40°, and a reference that demands more than the ship can do.
    """
    loaded = load_checked(scenario, parse_changes(changes))
    found, of_guided = study(loaded), loaded.controller.law == "guided"
    if as_json:
        print_json(_content(loaded, found))
        return
    if of_guided:
        print_table(["gain", "origin", "unit", "reason", "value", "number"], _gains(loaded), title="gains", text_columns=4)
        print_line(_units(loaded))
    else:
        print_table(
            ["gain", "unit", "meaning", "value"], _declared(loaded), title=f"gains of {loaded.controller.law}", text_columns=3
        )
    print_table(["loop", "gain margin", "phase margin", "delay margin", "crossover"], _margins(found), title="margins")
    print_line(f"linearised about a straight path at {quantity(found.speed, 'm/s')}; limits of magnitude and rate are not linear")
    for line in shortcomings(loaded, found):
        print_warning(line)


def _content(scenario: Scenario, found: Study) -> dict[str, Any]:
    """Law, gains by their names, margins by the loops, and the warnings, for programs; in SI units, dB and degrees."""
    c = scenario.controller
    used = by_hand_or_derived(c.guided, c.vessel.as_controlled()) if c.law == "guided" else getattr(c, c.law)
    margins = {name: loop._asdict() for name, loop in found.loops.items()}
    values = {name: attrgetter(name)(used) for name in (RULES if c.law == "guided" else _numbers_of(used))}
    return {"law": c.law, "gains": values, "margins": margins, "warnings": shortcomings(scenario, found)}


def _numbers_of(parameters: Any) -> list[str]:
    """The names of the numbers that a law declares and that may be changed while it runs."""
    return [name for name, entry in entries(type(parameters)).items() if entry.tunable and entry.type is float]


def _declared(scenario: Scenario) -> list[list[str]]:
    """A row for each gain of a law without a rule."""
    own = getattr(scenario.controller, scenario.controller.law)
    declared = entries(type(own))
    return [
        [name, declared[name].unit, declared[name].description.rstrip("."), number(attrgetter(name)(own))]
        for name in _numbers_of(own)
    ]


def _gains(scenario: Scenario) -> list[list[str]]:
    """A row for each gain of the rule."""
    by_hand, vessel = scenario.controller.guided, scenario.controller.vessel.as_controlled()
    used, declared, d = by_hand_or_derived(by_hand, vessel), entries(GuidedParameters), dynamics(vessel)
    rows = []
    for name, rule in RULES.items():
        value, origin = getattr(used, name), "derived" if getattr(by_hand, name) < 0.0 else "by hand"
        T = unit_time(vessel) * (d.q if rule.stretches else 1.0)
        powers = "·".join(f"{unit}{_power(power)}" for unit, power in (("L", rule.length), ("T", rule.time)) if power)
        shown = f"{value / (vessel.length**rule.length * T**rule.time):.3g} {powers}".rstrip()
        rows.append([name, origin, declared[name].unit, REASONS[name], number(value), shown])
    return rows


def _power(power: int) -> str:
    return "" if power == 1 else {2: "²", -1: "⁻¹", -2: "⁻²"}[power]


def _units(scenario: Scenario) -> str:
    """The units of the gains, and what they follow from."""
    vessel = scenario.controller.vessel.as_controlled()
    d = dynamics(vessel)
    units = f"L = {quantity(vessel.length, 'm')}, T = {quantity(unit_time(vessel), 's')}"
    if d.q > 1.0:
        units += f" (times {d.q:.3g} for rates of the actuators' bandwidth)"
    if not d.declared:
        missing = "not all of lag, rate and dead time are" if d.partly else "no lag, rate or dead time is"
        return f"{units}; {missing} declared (controller.vessel.yaw_lag ...): the actuators are assumed slow"
    return f"{units}; slowness of the actuators {d.s:.2f}, from 0 for instant ones to 1"


def _margins(found: Study) -> list[list[str]]:
    """A row for each loop."""
    rows = []
    for name, loop in found.loops.items():
        gain = "none" if math.isinf(loop.gain_db) else f"{loop.gain_db:.1f} dB"
        phase = "none" if math.isinf(loop.phase_deg) else f"{loop.phase_deg:.0f}°"
        cells = [gain, phase, quantity(loop.delay, "s"), f"{loop.crossover:.2g} rad/s"]
        rows.append([name, *(cells if loop.stable else ["unstable"] * 4)])
    return rows
