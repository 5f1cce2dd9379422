"""`vessel-hsmc gains`: the gains of the law of a scenario, the units of those of `guided`, and the margins that they leave."""

import math
from collections.abc import Sequence
from operator import attrgetter
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_line, print_table, print_warning
from vessel_hsmc_ros.cli.options import json_option, load_checked, parse_changes, print_json, scenario_argument, set_option
from vessel_hsmc_ros.control.interface.actuators import dynamics, unit_time
from vessel_hsmc_ros.core.quantities import number, quantity
from vessel_hsmc_ros.core.schema import entries
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.studies.margins import Study, shortcomings, study


@click.command()
@scenario_argument
@set_option
@json_option
def gains(scenario: str, changes: Sequence[str], as_json: bool) -> None:
    """Print the gains of the law of SCENARIO, with the margins of its loops on the ship.

    Those of the guided law are in units of the ship's length L and of T = sqrt(yaw_inertia/yaw_moment_limit). The margins are
    those of the law linearised about a straight path at the speed of the reference. A warning names each loop with a gain margin
    below 6 dB or a phase margin below 40°, and a reference that demands more than the ship can do.
    """
    loaded = load_checked(scenario, parse_changes(changes))
    found = study(loaded)
    if as_json:
        print_json(_content(loaded, found))
        return
    law = loaded.controller.law
    print_table(["gain", "unit", "meaning", "value"], _declared(loaded), title=f"gains of {law}", text_columns=3)
    if law == "guided":
        print_line(_units(loaded))
    print_table(["loop", "gain margin", "phase margin", "delay margin", "crossover"], _margins(found), title="margins")
    print_line(f"linearised about a straight path at {quantity(found.speed, 'm/s')}; limits of magnitude and rate are not linear")
    for line in shortcomings(loaded, found):
        print_warning(line)


def _content(scenario: Scenario, found: Study) -> dict[str, Any]:
    """Law, gains by their names, their margins, and the warnings, for programs; margins in SI units, dB and degrees."""
    c = scenario.controller
    used = getattr(c, c.law)
    margins = {name: loop._asdict() for name, loop in found.loops.items()}
    values = {name: attrgetter(name)(used) for name in _numbers_of(used)}
    return {"law": c.law, "gains": values, "margins": margins, "warnings": shortcomings(scenario, found)}


def _numbers_of(parameters: Any) -> list[str]:
    """The names of the numbers that a law declares and that may be changed while it runs."""
    return [name for name, entry in entries(type(parameters)).items() if entry.tunable and entry.type is float]


def _declared(scenario: Scenario) -> list[list[str]]:
    """A row for each gain of the law."""
    own = getattr(scenario.controller, scenario.controller.law)
    declared = entries(type(own))
    return [
        [name, declared[name].unit, declared[name].description.rstrip("."), number(attrgetter(name)(own))]
        for name in _numbers_of(own)
    ]


def _units(scenario: Scenario) -> str:
    """The units of the gains, and whether the actuators are declared."""
    vessel = scenario.controller.vessel.as_controlled()
    units = f"L = {quantity(vessel.length, 'm')}, T = {quantity(unit_time(vessel), 's')}"
    if dynamics(vessel).declared:
        return units
    return f"{units}; not all of lag, rate and dead time is declared (controller.vessel.yaw_lag ...): every loop is looser"


def _margins(found: Study) -> list[list[str]]:
    """A row for each loop."""
    rows = []
    for name, loop in found.loops.items():
        gain = "none" if math.isinf(loop.gain_db) else f"{loop.gain_db:.1f} dB"
        phase = "none" if math.isinf(loop.phase_deg) else f"{loop.phase_deg:.0f}°"
        cells = [gain, phase, quantity(loop.delay, "s"), f"{loop.crossover:.2g} rad/s"]
        rows.append([name, *(cells if loop.stable else ["unstable"] * 4)])
    return rows
