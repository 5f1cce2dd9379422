"""`vessel-hsmc mission`: a mission file as legs that the reference sails, or as the survey of its area; refused item by item."""

import math
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
from rich.markup import escape

from vessel_hsmc_ros.boats.missions.files import read_mission
from vessel_hsmc_ros.boats.missions.legs import (
    Placed,
    completed,
    datum_of,
    fence_of_mission,
    leaving_fence,
    parameters_of,
    part_of,
    placed,
    positions,
    survey_of,
    table_of,
    unsendable,
    way_leaving_fence,
)
from vessel_hsmc_ros.boats.missions.mission import Mission, Pair, Refused
from vessel_hsmc_ros.cli.console import print_error, print_files, print_line, print_table, print_warning, progress_bar, write_new
from vessel_hsmc_ros.cli.options import (
    law_file_option,
    load_checked,
    output_option,
    refuse_without,
    running_vessel,
    set_option,
    vessel_option,
    workers_option,
)
from vessel_hsmc_ros.cli.sailing import detach_option, sail
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import shell_command
from vessel_hsmc_ros.core.kinematics import same
from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.scenario.own_ship import MARGIN
from vessel_hsmc_ros.scenario.parameters_file import dump_parameters
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, read_changes

COLUMNS = ("leg", "to", "corner", "x [m]", "y [m]", "length [m]", "course [deg]", "speed [m/s]", "time [s]", "hold [s]")

NAVSAT = "navsat_odom"
"""The node whose datum is that of the odometry."""


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--datum",
    metavar="LAT,LON",
    help="Origin of x and y, degrees [default: the planner's home, or the first place; with --send that of the vessel].",
)
@click.option("--route", metavar="NAME", help="The route to take of several in a GPX or GeoJSON file.")
@click.option("--legs", metavar="N|N-M|N-", help="Sail leg N, legs N to M, or all from N on; leg N leads to waypoint N.")
@click.option(
    "--resume", type=click.Path(path_type=Path), metavar="BAG", help="Sail from the first leg that BAG did not complete."
)
@click.option("--speed", type=click.FloatRange(1e-3, 100.0), help="Speed on legs without one of their own, m/s.")
@click.option("--swath", type=click.FloatRange(0.01, 1e4), help="Survey the polygon of a GeoJSON file with legs so far apart, m.")
@click.option("--along", type=float, default=90.0, metavar="DEG", help="Course of these legs, degrees from north [default: 90].")
@click.option("--skip-refused", is_flag=True, help="Sail the mission without what is refused.")
@click.option("--scenario", metavar="SCENARIO", help="Plan the mission with the vessel of a scenario.")
@click.option(
    "--into", type=click.Path(path_type=Path, dir_okay=False), metavar="PATH", help="Write its parameters to a new file."
)
@click.option("--send", is_flag=True, help="Send it to a running vessel and wait for the end, as `path` does.")
@detach_option
@vessel_option
def mission(file: Path, **given: Any) -> None:
    """Show the legs of the mission in FILE, and what of it cannot be sailed; write or send it.

    FILE is a .plan by QGroundControl, a .waypoints file, a mission by Cockpit, GPX, GeoJSON or CSV. A refused item ends the
    command with exit code 1 before anything is written or sent, unless --skip-refused is given.
    """
    _check_options(given)
    found = _placed(file, given)
    if given["swath"]:
        values = survey_of(found.mission, given["swath"], math.radians(90.0 - given["along"]), given["speed"])
        print_line(
            f"survey of {found.mission.areas[0].item} with a swath of {given['swath']:g} m, course {given['along']:g} degrees"
        )
        _show_file(found.mission, found)
        require_within(leaving_fence(replace(found.mission, points=())))
        _report(found.mission, given["skip_refused"])
    else:
        whole = _whole(found, given)
        values = parameters_of(whole)
    duration = _plan(values, given["scenario"], found.mission) if given["scenario"] else 0
    if given["into"]:
        _write(given["into"], values, found, file)
        run = f"{shlex.quote(given['scenario'] or 'SCENARIO')} --set @{shlex.quote(str(given['into']))}"
        longer = f" --set vessel_sim.duration={duration}" if duration else ""
        print_line(f"parameters: {given['into']}; next: {shell_command()} simulate {run}{longer}")
    if given["send"]:
        if whole.fences:
            print_warning(
                "the fence is not sent: the vessel keeps the one of its start, controller.safety.fence; --into writes it"
            )
        sail([(*point.place, 0.0) for point in whole.points], given["namespace"], given["detach"])


def _check_options(given: dict[str, Any]) -> None:
    """Refuse options that exclude each other."""
    if not given["send"]:
        refuse_without("--send", "namespace", "detach")
    if not given["swath"]:
        refuse_without("--swath", "along")
    for one, other in (("into", "send"), ("resume", "legs"), ("swath", "legs"), ("swath", "resume"), ("swath", "send")):
        if given[one] and given[other]:
            raise click.UsageError(f"give either --{one} or --{other}")
    if given["send"] and given["speed"]:
        raise click.UsageError("--speed goes with --into: a path message has no speeds")


def _whole(found: Placed, given: dict[str, Any]) -> Mission:
    """The legs to sail, shown and checked."""
    whole, first = found.mission, 1
    if legs := f"{_completed(given['resume'], found) + 1}-" if given["resume"] else given["legs"]:
        whole = part_of(whole, legs)
        first = max(1, int(legs.partition("-")[0]) - 1)
    if given["speed"]:
        whole = replace(whole, points=tuple(point._replace(speed=point.speed or given["speed"]) for point in whole.points))
    if not whole.points:
        raise ScenarioError(f"the mission must have a waypoint (got none){': --swath surveys its area' if whole.areas else ''}")
    _show(whole, first)
    _show_file(whole, found)
    require_within(leaving_fence(whole))
    if given["send"]:
        whole = replace(whole, refused=(*whole.refused, *unsendable(whole)))
    _report(whole, given["skip_refused"])
    return whole


def sailed_mission(file: Path) -> tuple[dict[str, object], Mission]:
    """The parameters of the reference ship that sail the mission of a file, and the mission; refused as the verb does."""
    whole = _placed(file, {"datum": None, "route": None, "send": False}).mission
    if not whole.points:
        raise ScenarioError(f"{file} must have a waypoint (got none)")
    require_within(leaving_fence(whole))
    _report(whole, skip=False)
    return parameters_of(whole), whole


def _placed(file: Path, given: dict[str, Any]) -> Placed:
    datum = None if given["datum"] is None else datum_of(given["datum"])
    read = read_mission(file, given["route"])
    if given["send"] and read.geographic:
        datum = _datum_of_vessel(given["namespace"], datum, file)
    if not read.points:  # before the error, as they are the reason
        for item in (*read.left_out, *read.refused):
            print_warning(f"refused: {item}")
    return placed(read, datum, f"mission file {file}")


def _datum_of_vessel(namespace: str, datum: Pair | None, file: Path) -> Pair:
    """The datum of a running vessel's odometry, or the given one where no node states it."""
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.remote import stated_datum

        own = stated_datum(remote)
        if own and datum:
            _require_datum(own, datum, remote.name(DATUM))
    if not (found := own or datum):
        what = f"because {file} is in latitude and longitude, and no node states the datum of the odometry on {DATUM}"
        raise ParameterError(f"--datum must be given with --send, {what}")
    return found


def _completed(bag: Path, found: Placed) -> int:
    """How many legs a recorded vessel has completed."""
    from vessel_hsmc_ros.bags.reader import open_bag
    from vessel_hsmc_ros.report.from_bag import of_vessel
    from vessel_hsmc_ros.report.record import hull_length

    opened = open_bag(bag)
    prefix = opened.namespace(None)
    if found.datum is not None:
        _require_datum(opened.parameters.get(f"{prefix}{NAVSAT}", {}).get("datum"), found.datum, str(bag))
    record = of_vessel(opened, prefix)
    done = completed(found.mission, record.run.state[:, :2], hull_length(record.scenario) or 1.0)
    if done == len(found.mission.points):
        raise ScenarioError(f"--resume: {bag} has completed all {done} legs: --legs sails some of them again")
    print_line(f"{bag} has completed {done} of {len(found.mission.points)} legs: leg {done + 1} is the next")
    return done


def _require_datum(own: Sequence[float] | None, datum: Pair, where: str) -> None:
    """Refuse a datum that is not that of the odometry, where that has one of its own."""
    if own and not same(own, datum):
        raise ParameterError(f"--datum must be that of {where}, {own[0]},{own[1]} (got {datum[0]},{datum[1]})")


def _show(whole: Mission, first: int) -> None:
    """Print the legs."""
    rows = [[escape(cell) for cell in row] for row in table_of(whole, first)]
    print_table(COLUMNS, rows, text_columns=3)
    places, known = positions(whole.points), all(point.speed for point in whole.points[1:])
    lengths = [abs(b - a) for a, b in pairwise(places)]
    time = sum(length / (point.speed or math.inf) for length, point in zip(lengths, whole.points[1:], strict=True))
    time += sum(point.hold for point in whole.points)
    many, lasting = "s" if len(places) > 1 else "", f", {time:.0f} s at these speeds" if known else ""
    print_line(f"{len(places)} waypoint{many}, {sum(lengths):.1f} m from the first on{lasting}")


def _show_file(whole: Mission, found: Placed) -> None:
    """Print the datum, and what else the file has."""
    if found.datum:
        print_line(f"datum: {found.datum[0]:.7f},{found.datum[1]:.7f} ({found.datum_of}); navsat_odom.datum has to be the same")
    if whole.fences:
        print_line(f"fences: {len(whole.fences)}, against which the legs are checked, not the turns")
    if whole.areas and whole.points:
        print_line(f"areas: {len(whole.areas)}, which --swath surveys instead of the route")
    for k, (x, y) in enumerate(whole.rally, 1):
        print_line(f"rally point {k}: x = {x:.2f}, y = {y:.2f}; it is not used")
    for item in whole.left_out:
        print_line(f"left out: {item}")


def require_within(leaving: Sequence[Refused]) -> None:
    """Refuse a mission that leaves its own fence, also where items that are refused are skipped."""
    for item in leaving:
        print_warning(f"refused: {item}")
    if leaving:
        raise GoalError(f"the mission must stay within its own fence (got {leaving[0]})")


def _report(whole: Mission, skip: bool) -> None:
    """Name what is refused."""
    for item in whole.refused:
        print_warning(f"refused: {item}")
    if whole.refused and not skip:
        n = len(whole.refused)
        raise GoalError(
            f"{n} item{'s are' if n > 1 else ' is'} refused: --skip-refused sails the mission without what cannot be sailed"
        )


def _plan(values: dict[str, object], name: str, whole: Mission) -> int:
    """Plan the mission with a vessel, which shows what it cannot sail."""
    from vessel_hsmc_ros.guidance.factory import make_reference

    changes = {f"reference_ship.{key}": value for key, value in values.items()}
    p = load_checked(name, changes).reference_ship
    reference: Any = make_reference(replace(p, follow="time"), 1.0 / p.rate_hz)
    require_within(way_leaving_fence(reference.track, whole.fences))
    duration = float(reference.constants.table.times[-1])
    print_line(f"planned with {name}: {duration:.0f} s from its initial pose on, with the turns of its vessel")
    return math.ceil(MARGIN * duration)


def _write(into: Path, values: dict[str, object], found: Placed, file: Path) -> None:
    """Write the parameters of the reference ship, their datum, and the fence for it and the controller."""
    datum = f", datum {found.datum[0]:.9f},{found.datum[1]:.9f}" if found.datum else ""
    fence = fence_of_mission(found.mission)
    stated = {"actions.datum": list(found.datum)} if found.datum else {}
    sections = {**fence, "reference_ship": {**values, **stated, **fence.get("reference_ship", {})}}
    head = f"# The mission {file.name.encode('ascii', 'replace').decode()}{datum}: parameters for --set @FILE.\n"
    head = "".join(c if c.isprintable() or c == "\n" else "?" for c in head)
    write_new(into, head + dump_parameters(sections))


NOT_TODAY = 1  # exit code of a mission that is infeasible, or that too many runs fail


@click.command()
@click.argument("mission")
@click.option("--scenario", metavar="SCENARIO", help="The boat, where MISSION is not a scenario.")
@click.option("--wind", type=float, metavar="M/S", help="Mean wind speed [default: that of the scenario].")
@click.option("--wind-from", type=float, metavar="DEG", help="Where the wind comes from, from north.")
@click.option("--current", type=float, metavar="M/S", help="Speed of the current [default: that of the scenario].")
@click.option("--current-to", type=float, metavar="DEG", help="Where the current flows to, from north.")
@click.option("--corridor", type=float, metavar="M", help="Distance from the path beyond which a run fails [default: 2 lengths].")
@click.option("--runs", type=click.IntRange(20, 100_000), default=200, show_default=True, help="Number of runs.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of all that is drawn.")
@workers_option
@set_option
@law_file_option
@output_option
def forecast(mission: str, scenario: str | None, changes: dict[str, object], output: Path, **given: Any) -> None:
    """Tell whether a vessel can do a mission in today's wind and current, and what it takes.

    MISSION is a mission file, or one that `mission --into` wrote, and --scenario is the boat; or MISSION is a scenario with a
    path or a survey. A leg that no law can sail is named without a run. Otherwise --runs runs are simulated, each with its own
    gusts, error of wind and current, hull and noise: time, energy, battery and distance from the path as bands of 5, 50 and
    95 %, and a page. The exit code is 1 where a leg is infeasible, or more than 5 % of the runs fail.
    """
    _check_directions(given)
    loaded, fences = _loaded(mission, scenario, changes)
    from vessel_hsmc_ros.studies.forecast import forecast as studies  # imports the libraries of reports

    plan = studies.plan_of(loaded, _conditions(loaded, given), given["corridor"])
    _check_way(plan.track, fences)
    if reasons := studies.why_infeasible(plan):
        for line in reasons:
            print_error(line)
        sys.exit(NOT_TODAY)
    check_writable(output)
    with progress_bar(f"forecast of {loaded.name}", given["runs"], "runs") as update:
        found = studies.forecast(plan, given["runs"], given["seed"], given["workers"], update)
    from vessel_hsmc_ros.studies.forecast import page

    print_table(*page.overview(found))
    print_files(page.write(make_run_folder(output, f"{loaded.name}_forecast").path, found))
    for line in page.verdict(found):
        (print_line if found.succeeds else print_error)(line)
    sys.exit(0 if found.succeeds else NOT_TODAY)


def _check_directions(given: dict[str, Any]) -> None:
    """Refuse a speed without its direction, and a direction without its speed."""
    for speed, direction in (("wind", "wind-from"), ("current", "current-to")):
        has, towards = given[speed], given[direction.replace("-", "_")]
        if has and towards is None:
            raise click.UsageError(f"--{direction} must be given with --{speed}")
        if has is None and towards is not None:
            raise click.UsageError(f"--{direction} goes with --{speed}")


def _loaded(mission: str, scenario: str | None, changes: dict[str, object]) -> tuple[Scenario, Sequence[Any]]:
    """The boat with its mission, and the fences of the mission."""
    path = Path(mission)
    is_yaml = path.suffix in (".yaml", ".yml")
    if scenario is None:
        loaded = load_scenario(mission, changes) if is_yaml or not path.exists() else None
        if loaded is None or not any(name.startswith("vessel_sim.") for name in loaded.given):
            raise ParameterError(f"--scenario must name the boat that sails {mission} (got none): vessel-hsmc init writes it")
        return load_checked(mission, changes), ()
    if is_yaml:
        return replace(load_checked(scenario, {**read_changes(path), **changes}), name=path.stem), ()

    parameters, whole = sailed_mission(path)
    values = {f"reference_ship.{name}": value for name, value in parameters.items()}
    return replace(load_checked(scenario, {**values, **changes}), name=path.stem), whole.fences


def _check_way(track: Any, fences: Sequence[Any]) -> None:
    """Refuse a mission whose planned way leaves its fence."""
    if fences:
        from vessel_hsmc_ros.boats.missions.legs import way_leaving_fence

        require_within(way_leaving_fence(track, fences))


def _conditions(loaded: Scenario, given: dict[str, Any]) -> Any:
    """Wind and current as given, else those of the scenario."""
    from vessel_hsmc_ros.studies.forecast.forecast import Conditions, conditions_of

    names = {name: given[name] for name in schema.entries(Conditions) if given[name] is not None}
    try:
        return schema.changed(conditions_of(loaded), names, "forecast")
    except ParameterError as error:
        option, _, rest = str(error).removeprefix("forecast.").partition(" ")
        raise ParameterError(f"--{option.replace('_', '-')} {rest}") from None
