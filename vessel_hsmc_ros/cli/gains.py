"""The verbs on the gains of a law: `gains` and their margins, `certify` and `tune`."""

import math
import shlex
from collections.abc import Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_files, print_line, print_status, print_table, print_warning, progress_bar
from vessel_hsmc_ros.cli.options import (
    folder_option,
    json_option,
    law_file_option,
    load_checked,
    print_json,
    scenario_argument,
    set_option,
)
from vessel_hsmc_ros.control.interface.actuators import dynamics, unit_time
from vessel_hsmc_ros.core.quantities import number, quantity
from vessel_hsmc_ros.core.schema import entries
from vessel_hsmc_ros.scenario.run_folder import folder_for
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.studies.certificate import BOX, Case, Limits, Part, at_a_point, case_of, limits_of, under_way
from vessel_hsmc_ros.studies.margins import Study, shortcomings, study


@click.command()
@scenario_argument
@set_option
@json_option
def gains(scenario: str, changes: dict[str, object], as_json: bool) -> None:
    """Print the gains of the law of SCENARIO, with the margins of its loops on the ship.

    Those of the guided law are in units of the ship's length L and of T = sqrt(yaw_inertia/yaw_moment_limit). The margins are
    those of the law linearised about a straight path at the speed of the reference. A warning names each loop with a gain margin
    below 6 dB or a phase margin below 40°, and a reference that demands more than the ship can do.
    """
    loaded = load_checked(scenario, changes)
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


EXACT = 1e-6
"""Share of the length below which a bound counts as none."""


@click.command()
@scenario_argument
@set_option
@json_option
def certify(scenario: str, changes: dict[str, object], as_json: bool) -> None:
    """Print what holds near the reference for the hierarchical law on the vessel of SCENARIO, whose data may be wrong by 20 %.

    A bound of the position error under way and at rest in the wind, current and noise of the scenario, or the condition that
    fails; the dead time and the control rate that the law tolerates; and what no law can do with this vessel. docs/theory.md says
    what is proven.
    """
    loaded = load_checked(scenario, changes)
    case = case_of(loaded)
    parts = {**({"under way": under_way(case)} if case.speed > 0.0 else {}), "at rest": at_a_point(case)}
    limits = limits_of(case)
    if as_json:
        print_json({**{name: _part_content(part) for name, part in parts.items()}, "limits": limits._asdict()})
        return
    title = f"conditions, each above 1, with hull data to {100 * BOX:.0f} %"
    rows = [
        [name, each.name, f"{each.ratio.low:.3g} to {each.ratio.high:.3g}"]
        for name, part in parts.items()
        for each in part.clauses
    ]
    print_table(["", "condition", "value"], rows, title=title, text_columns=2)
    show(parts, case.known.length)
    for line in [*_not_covered(loaded), *_in_words(case, limits)]:
        print_line(line)


def show(parts: dict[str, Part], length: float) -> None:
    """Print a line on each part: its bound, or the condition that fails; the length of the hull in m."""
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


def _part_content(part: Part) -> dict[str, Any]:
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


@click.command()
@click.argument("source", metavar="SCENARIO|SUITE|CAMPAIGN")
@click.option("--law", help="The law to tune [default: that of the scenario].")
@click.option(
    "--gain",
    "gains",
    multiple=True,
    required=True,
    metavar="NAME[=LOW:HIGH[:log]]",
    help="A gain, such as controller.guided.position_gain=0.05:0.5:log; without a range, a decade around its present value. An"
    " asterisk stands for any part of the name. May be given several times.",
)
@click.option("--trials", type=click.IntRange(min=1), default=100, show_default=True, help="Number of trials.")
@click.option(
    "--metric", default="position_error_rms_last_quarter", show_default=True, help="Metric of the cost, as in run.json."
)
@click.option(
    "--second-metric",
    help="Metric of the effort, such as yaw_moment_rms, which is minimised too: the result is a front of trade-offs.",
)
@click.option(
    "--aggregate",
    type=click.Choice(["geometric_mean", "worst"]),
    default="geometric_mean",
    show_default=True,
    help="How the metrics of several runs become one cost.",
)
@click.option("--held-out", metavar="SCENARIO|SUITE|CAMPAIGN", help="Runs to evaluate the result on [default: other seeds].")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of the search.")
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    help="Number of parallel runs [default: one per core for 100 runs or more a trial, else 1].",
)
@set_option
@law_file_option
@folder_option("Folder of the tuning; one that exists is continued [default: a new one in runs].")
def tune(
    source: str,
    law: str | None,
    gains: Sequence[str],
    trials: int,
    held_out: str | None,
    seed: int,
    workers: int | None,
    changes: dict[str, object],
    output: Path | None,
    **objective: Any,
) -> None:
    """Search the gains of a law with the smallest cost over a scenario, the rows of a suite or the draws of a campaign.

    All trials use the same runs with the same noise. The command writes the gains as a parameters file (best.yaml), a page,
    pictures and a table of all trials. The same command with the same --output continues after an interruption, or with more
    --trials.
    """
    # Imported here: Optuna takes half a second, which the other verbs need not spend.
    from vessel_hsmc_ros.studies.tuning.files import GAINS_HEAD, gains_table, write
    from vessel_hsmc_ros.studies.tuning.plan import LAW, Tuning, chosen_objective, held_out_cases, law_of, load_cases, parse_gains
    from vessel_hsmc_ros.studies.tuning.result import tune as run_tuning
    from vessel_hsmc_ros.studies.tuning.result import verdict

    runs = load_cases(source, changes | ({} if law is None else {LAW: law}))
    law = law_of(runs)
    tuning = Tuning(runs, parse_gains(gains, law, runs[0].scenario), chosen_objective(**objective), seed, workers)
    unseen = held_out_cases(source if held_out is None else held_out, changes, law, others=held_out is not None)
    folder = folder_for(output, f"{Path(source).stem}_{law}_tune")
    again = "the same command" if output else f"the same command with --output {shlex.quote(str(folder))}"
    print_status(f"folder: {folder}; after an interruption {again} continues the search")
    with progress_bar(f"tuning {law} over {len(runs)} {'run' if len(runs) == 1 else 'runs'}", trials, "trials") as update:
        result = run_tuning(tuning, folder, trials, unseen, lambda done, best: update(done, note=best))
    print_table(GAINS_HEAD, gains_table(result))
    for line in verdict(result):
        print_line(line)
    print_files(write(folder, result))
