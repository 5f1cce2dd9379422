"""`vessel-hsmc ardupilot`: a scenario's ship as the physics of ArduPilot's simulated autopilot."""

import click

from vessel_hsmc_ros.boats.ardupilot import PORT, Physics, Wiring, serve
from vessel_hsmc_ros.boats.autopilot import Pulses
from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import load_checked, parse_changes, scenario_argument, set_option
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.quantities import number_of


@click.command()
@scenario_argument
@set_option
@click.option("--servos", default="1,3", show_default=True, help="Outputs of the thrusters; without thrusters, left and right.")
@click.option("--pulses", default="1100,1500,1900", show_default=True, help="Pulse widths astern, at rest and ahead, µs.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", default=PORT, show_default=True, type=click.IntRange(0, 65535), help="Port to listen on; 0: any.")
@click.option("--duration", default=0.0, help="Simulated time after which it ends, s; 0: never.")
def ardupilot(scenario: str, changes: tuple[str, ...], servos: str, pulses: str, host: str, port: int, duration: float) -> None:
    """Simulate the ship for ArduPilot's autopilot (SITL, frame JSON).

    The ship of SCENARIO with its sea and its actuators takes the place of ArduPilot's own boat, one time step for each frame.
    """
    loaded = load_checked(scenario, parse_changes(changes))
    widths = _numbers(pulses, "--pulses")
    if len(widths) != 3 or sorted(set(widths)) != widths:
        raise ParameterError(f"--pulses must be three increasing widths (got {pulses})")
    physics = Physics(loaded.vessel_sim, Wiring(tuple(map(int, _numbers(servos, "--servos"))), Pulses(*widths)))
    try:
        serve(physics, (host, port), duration, print_line)
    finally:
        print_line(f"{physics.frames} frames, {physics.lost} lost, {physics.repeated} repeated; {physics.time:.1f} s simulated")


def _numbers(text: str, option: str) -> list[float]:
    try:
        found = [number_of(part) for part in text.split(",")]
    except ValueError:
        found = []
    if not found or min(found) < 1.0:
        raise ParameterError(f"{option} must be numbers from 1 on, with commas between them (got {text})")
    return found
