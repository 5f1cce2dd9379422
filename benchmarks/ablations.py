"""The repaired law with one of its changes undone at a time: `python benchmarks/ablations.py [--write]`.

Prints the rms position error [m] of the last quarter of 400 s, and the rms change of the moment per period on the circle with
noisy positions, in percent of the limit. --write replaces the table in docs/verdict.md. Takes some minutes.

Every row is the law of the package but for what it names: other parameters, other constants
(`studies.paper.reproduction.AlteredLaw`), or kernels of this file instead of those of the law. The last ones run interpreted.
"Errors from the earth's origin" is the law as printed with the point 3 m ahead, with a reaching gain of 1 1/s, a boundary layer
and the limits of the actuators.
"""

import argparse
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.network import Estimates
from vessel_hsmc_ros.control.laws.hierarchical import (
    Guidance,
    Memory,
    Surfaces,
    adapt_weights,
    control,
    guidance,
    step,
    turn_in_current,
)
from vessel_hsmc_ros.control.laws.hierarchical_parameters import Gains
from vessel_hsmc_ros.core.exceptions import ControlError, SimulationError
from vessel_hsmc_ros.core.kernel import bound
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, to_body
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_hsmc_ros.studies.batch import run_all
from vessel_hsmc_ros.studies.paper.cases import CALM, LIMITS, NO_NETWORKS, PRINTED, TOLD
from vessel_hsmc_ros.studies.paper.reproduction import AlteredLaw

PAGE = Path(__file__).resolve().parents[1] / "docs" / "verdict.md"
TABLE = re.compile(r"(<!-- generated: ablations -->\n).*?(<!-- end -->)", re.DOTALL)

CIRCLE, STRAIGHT, SLALOM, REST = "case2_tracking", "case2_straight", "case2_slalom", "case3_stabilisation"
NOISY = "moment, noisy circle"
COLUMNS: dict[str, tuple[str, Mapping[str, object]]] = {
    "circle": (CIRCLE, {}),
    "straight line": (STRAIGHT, {}),
    "slalom": (SLALOM, {}),
    "station keeping": (REST, {}),
    "calm": (REST, CALM),
    "beam current of 0.3 m/s": (STRAIGHT, {**CALM, "vessel_sim.disturbance.current.north": 0.3}),
    NOISY: (CIRCLE, {"vessel_sim.sensors.position_noise": 0.05}),
}
"""Scenario and changes of each column; the last one is the change of the moment with noise of 5 cm on x and y."""

NEGLIGIBLE = 1e-5
"""Errors, m, and changes of the moment, %, below this are shown as 0."""

HEADING_SLOPE = 0.3
"""The printed slope c2 of sigma2, 1/s."""


def turn_with_slope(
    motion: Motion, desired: Motion, acceleration: Acceleration, c: tuple[float, float, float], g: Gains
) -> tuple[float, float]:
    """The yaw rate of the reference less c2·sin(psi_e), and its rate: sigma2 then contains c2·sin(psi_e)."""
    psi_e = motion.psi - desired.psi
    rate, drate = turn_in_current(desired, acceleration, c, g)
    return rate - HEADING_SLOPE * math.sin(psi_e), drate - HEADING_SLOPE * math.cos(psi_e) * (motion.r - desired.r)


def step_with_slope(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, constants: Any, *of_measurement: float
) -> Any:
    """The law with c2 of (17) as printed."""

    def turn(desired: Motion, acceleration: Acceleration, c: tuple[float, float, float], g: Gains) -> tuple[float, float]:
        return turn_with_slope(motion, desired, acceleration, c, g)

    return bound(step, turn_in_current=turn)(motion, desired, acceleration, m, constants, *of_measurement)


def steady_guidance(motion: Motion, desired: Motion, acceleration: Acceleration, g: Gains) -> Guidance:
    """The wanted velocity without its rate."""
    return guidance(motion, desired, acceleration, g)._replace(dw1=0.0, dw2=0.0)


def printed_adaptation(m: Memory, _errors: tuple[float, float, float], S: tuple[float, float, float], g: Gains) -> None:
    """(29) as printed: dWv = gamma1·S2, dWr = gamma2·a·S1, dWu = gamma3·(b·z1·S1 - a·z1·S1 + z2·S2), here with a = 1, b = l."""
    S2, S1, lever = S
    z1, z2 = position[0]
    adapt_weights(m, (0.0, 0.0, 0.0), (z1 * (lever - S1) + z2 * S2, S2, S1), g)


position = [(0.0, 0.0)]
"""z1 and z2 of the last control period, which the adaptation of the law does not take."""


def control_with_position(motion: Motion, n: Guidance, turn: Any, c: Any, way: float, f: Estimates, g: Gains) -> Surfaces:
    """The control of the law, which leaves z1 and z2 for the adaptation as printed."""
    position[0] = to_body(motion.x, motion.y, motion.psi)
    return control(motion, n, turn, c, way, f, g)


class Variant(AlteredLaw):
    """The law with another kernel; as a class of this file it runs interpreted."""

    def use(self, kernel: Callable[..., Any]) -> "Variant":
        """The law with this kernel."""
        self.kernel = kernel  # type: ignore[misc]
        return self


KERNELS: dict[str, Callable[..., Any]] = {
    "slope": step_with_slope,
    "steady": bound(step, guidance=steady_guidance),
    "printed": bound(step, adapt_weights=printed_adaptation, control=control_with_position),
}


class Row(NamedTuple):
    """What is undone: parameters, constants by their symbols, or a kernel of KERNELS."""

    change: str
    undone: str
    parameters: Mapping[str, object] = {}
    constants: Mapping[str, float] = {}
    kernel: str = ""


def network(**values: object) -> Mapping[str, object]:
    """Parameters of the network."""
    return {f"controller.hierarchical.network.{name}": value for name, value in values.items()}


ORIGIN: Mapping[str, object] = {
    "controller.law": PRINTED,
    **LIMITS,
    **{
        f"controller.hierarchical_printed.{name}": value
        for name, value in {
            **{"sway_weight": 100.0 / 3.0, "yaw_reaching_gain": 1.0, "surge_reaching_gain": 1.0, "switching": "saturation"},
            **{"yaw_adaptation_gain": 1e-6, "sway_adaptation_gain": 1e-6, "surge_adaptation_gain": 0.04},
        }.items()
    },
}

ROWS = (
    Row("", "nothing"),
    Row("1", "errors from the earth's origin", ORIGIN),
    # The surface's part of the adaptation grows with l²: without it the row shows the lever alone.
    Row("2", "the point 100 km ahead", constants={"l0": 1e5, "T_a": 0.0, "gamma1": 0.0, "gamma2": 0.0}),
    Row("2", "always 5 m ahead", constants={"l0": 5.0, "T_a": 0.0}),
    Row("2", "always 1 m ahead", constants={"l0": 1.0, "T_a": 0.0}),
    Row("3", "c2 = 0.3 1/s", kernel="slope"),
    Row("4", "k = 100 1/s", constants={"k1": 100.0, "k2": 100.0}),
    Row("4", "sgn instead of a boundary layer", constants={"phi1": 1e-9, "phi2": 1e-9}),
    Row("5", "(29) as printed", kernel="printed"),
    Row("5", "(29) corrected, without prediction errors", constants={"rho": 0.0}),
    Row("5", "prediction errors alone", constants={"gamma1": 0.0, "gamma2": 0.0, "gamma3": 0.0}),
    Row("", "no networks", constants=NO_NETWORKS),
    Row("", "one neuron instead of 27", network(layout="listed")),
    Row("", "no rate of the wanted velocity", kernel="steady"),
    Row("", "eta = 0", constants={"eta1": 0.0, "eta2": 0.0}),
)


def result(task: tuple[Row, str], _progress: Callable[[float], None]) -> str:
    """One cell of the table."""
    row, column = task
    name, changes = COLUMNS[column]
    scenario = load_scenario(name, {**TOLD, **changes, **row.parameters})
    c = scenario.controller
    arguments = c.hierarchical, c.vessel, 1.0 / c.rate_hz, row.constants
    law: Any = AlteredLaw(*arguments) if row.constants else None
    if row.kernel:
        law = Variant(*arguments).use(KERNELS[row.kernel])
    try:
        run = simulate(scenario, law=law)
    except (ControlError, SimulationError):
        return "singular"
    late = len(run.time) * 3 // 4
    if column == NOISY:
        return f"{two_digits(100.0 * rms(np.diff(run.wrench[late:, 1])) / c.vessel.yaw_moment_limit)} %"
    return two_digits(rms(position_error(run.state, run.reference)[late:]))


def two_digits(value: float) -> str:
    """A number with two significant digits, and 0 for one that is not to be told from it."""
    if value < NEGLIGIBLE:
        return "0"
    text = f"{value:.2g}"
    return f"{float(text):.0f}" if value >= 10.0 else text


def table() -> str:
    """All rows, in Markdown."""
    tasks = [(row, column) for row in sorted(ROWS, key=lambda row: not row.kernel) for column in COLUMNS]
    found = dict(zip(((row.undone, column) for row, column in tasks), run_all(result, tasks), strict=True))
    lines = [f"| change | undone | {' | '.join(COLUMNS)} |", f"|---|---|{'---|' * len(COLUMNS)}"]
    for row in ROWS:
        cells = " | ".join(found[row.undone, column] for column in COLUMNS)
        lines.append(f"| {row.change} | {row.undone} | {cells} |")
    return "\n".join(lines)


def main() -> None:
    """Print the table, and write it into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="replace the table in docs/verdict.md")
    write = parser.parse_args().write
    text = table()
    print(text)
    if write:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(TABLE.sub(lambda match: f"{match[1]}{text}\n{match[2]}", page), encoding="utf-8")


if __name__ == "__main__":
    main()
