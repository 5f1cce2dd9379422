"""`vessel-hsmc excite`: the manoeuvres worth sailing for an identification, as a scenario."""

import math
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np
import yaml

from vessel_hsmc_ros.cli.console import print_line, print_table
from vessel_hsmc_ros.cli.options import file_option
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.install_paths import shell_command
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.scenario.bounded_text import read_text, read_yaml
from vessel_hsmc_ros.scenario.own_ship import ship_of
from vessel_hsmc_ros.scenario.parameters_file import in_one_line, tree
from vessel_hsmc_ros.scenario.scenario import load_scenario, parse_scenario, scenario_names
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from vessel_hsmc_ros.core.run_data import Run
    from vessel_hsmc_ros.plant.dynamics import ShipParameters
    from vessel_hsmc_ros.studies.identification.excitation import Step


@click.command()
@click.argument("ship", metavar="VESSEL|SCENARIO")
@file_option("The scenario to write [default: NAME_excite.yaml].")
def excite(ship: str, output: Path | None) -> None:
    """Write a scenario of manoeuvres from which `identify` can determine a ship's hull data.

    VESSEL is a vessel of the library or a vessel file. SCENARIO is a scenario or its file, such as one that `vessel-hsmc init`
    has written. The hull data need not be exact: they only scale forces and times. The scenario commands surge force and yaw
    moment without feedback. Simulate it, or sail it with your own boat and record a bag, and pass the bag to
    `vessel-hsmc identify`. The command prints the manoeuvres and the space that they need.
    """
    from vessel_hsmc_ros.simulation.offline import simulate
    from vessel_hsmc_ros.studies.identification.excitation import excitation, scenario_text

    data, section = _ship(ship)
    scale = scale_of(data)
    steps = excitation(scale)
    path = output or Path(f"{Path(ship).stem}_excite.yaml")
    text = scenario_text(path.stem, f"ship {Path(ship).stem}", section, scale, steps)
    run = simulate(parse_scenario(text, path.stem, source="the new scenario"))
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ScenarioError(f"{path} exists and is not overwritten: choose another name with --file, or delete it") from None
    except OSError as error:
        raise ScenarioError(f"{path} cannot be written: {error.strerror}") from None
    print_table(HEAD, _rows(steps, run))
    print_line(_space(run))
    simulate_it = f"{shell_command()} simulate {shlex.quote(str(path))}"
    print_line(f"scenario: {path}; next: {simulate_it}, or sail it; then {shell_command()} identify on the bag")


HEAD = ["manoeuvre", "time", "surge force", "yaw moment", "speed", "yaw rate"]


def _ship(name: str) -> "tuple[ShipParameters, str]":
    """The ship of a vessel or of a scenario, and the section `vessel` that describes it in a new scenario."""
    is_file = Path(name).suffix in (".yaml", ".yml")
    if name in vessel_names() or (is_file and _is_vessel_file(Path(name))):
        values: dict[str, object] = dict(read_vessel(name).values)
        section = {"vessel": name} if not is_file else tree(values)
    elif is_file or name in scenario_names():
        values = _hull_data(load_scenario(name).vessel_sim.vessel)
        section = tree(values)
    else:
        raise ScenarioError(
            f"{name} is neither a vessel nor a scenario: it must be one of {', '.join(vessel_names())}, or a file"
        )
    text = yaml.safe_dump(section, sort_keys=False, default_flow_style=None)
    return ship_of(values), "\n".join(f"    {line}" for line in text.splitlines())


def _hull_data(ship: "ShipParameters") -> dict[str, object]:
    """The data of a ship by their dotted names, without those that have no meaning for it."""
    entries = schema.entries(type(ship))
    return {
        f"vessel.{key}": value
        for key, value in schema.flatten(ship).items()
        # A coefficient of zero is written: left out, it would be that of the paper's ship.
        if key != "name" and (value != entries[key].default or (isinstance(value, float) and math.isfinite(value)))
    }


def _is_vessel_file(path: Path) -> bool:
    """Whether a YAML file describes a vessel, not a scenario."""
    try:
        document = read_yaml(read_text(path))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ScenarioError(f"file {path} cannot be read: {in_one_line(error)}") from None
    return isinstance(document, dict) and "vessel" in document


def _rows(steps: "Sequence[Step]", run: "Run") -> list[list[str]]:
    """A row for each manoeuvre: its inputs, and what the present data predict."""
    from vessel_hsmc_ros.studies.identification.excitation import manoeuvres, starts

    times, rows = starts(steps), []
    for first, last in manoeuvres(steps):
        inside = (run.time >= times[first]) & (run.time < times[last])
        u, v, r = run.state[inside, 3:].T
        surge, yaw = [step.surge for step in steps[first:last]], [step.yaw for step in steps[first:last]]
        motion = f"{np.hypot(u, v).max():.2f} m/s", f"{np.degrees(abs(r).max()):.1f}°/s"
        rows.append([steps[first].manoeuvre, f"{times[first]:g} to {times[last]:g} s", _range(surge), _range(yaw), *motion])
    return rows


def _range(shares: "Sequence[float]") -> str:
    low, high = (100.0 * end for end in (min(shares), max(shares)))
    return f"{low:.0f} %" if low == high else f"±{high:.0f} %" if low == -high else f"{low:.0f} to {high:.0f} %"


def _space(run: "Run") -> str:
    """How long the manoeuvres take, and how much water."""
    x, y = np.ptp(run.state[:, :2], axis=0)
    minutes = run.time[-1] / 60.0
    return (
        f"they take {minutes:.1f} min and, with the present data, {quantity(float(x), 'm')} by {quantity(float(y), 'm')} of water"
    )
