"""`python -m vessel_hsmc_ros.simulation.compile` compiles laws and references beforehand, and keeps the machine code.

`make laws` calls it, so that no first simulation of a law has to wait.
"""

import logging
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from typing import Any, NamedTuple, cast

from vessel_hsmc_ros.control.interface.law import KernelLaw
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.guidance.factory import make_reference
from vessel_hsmc_ros.guidance.timetable import follow
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compilation import available, compiled
from vessel_hsmc_ros.simulation.compiled_loop import compiled_loop, make_loop, reference_of
from vessel_hsmc_ros.simulation.loop import is_compilable

THRUSTERS = share_directory() / "config" / "thrusters" / "case2_thrusters.yaml"


class Program(NamedTuple):
    """A closed loop that is compiled on its own: a law, with the observer or not, driven by thrusters or by a wrench."""

    law: str
    observed: bool = False
    by_thrusters: bool = False

    def __str__(self) -> str:
        """As `make laws` shows it."""
        return f"law {self.law}{' with thrusters' * self.by_thrusters}{' with the observer' * self.observed}"


OFTEN = (Program("guided", observed=True), *(Program(law, by_thrusters=True) for law in ("guided", "open_loop")))
"""Programs that are often used, besides each law alone; `init --thrusters` takes the last one."""

MODES = ("course", "goal", "path", "circle")
"""A mode of the reference for each of its kernels; that of the virtual ship is compiled with the laws."""


def compilable_laws() -> dict[str, type[KernelLaw[Any]]]:
    """The laws that can be compiled, by their names."""
    classes = {name: LAWS[name].controller for name in LAWS}
    return {name: cls for name, cls in classes.items() if issubclass(cls, KernelLaw) and is_compilable(cls)}


def compile_program(program: Program) -> None:
    """Compile a program, unless it is stored."""
    name = THRUSTERS if program.by_thrusters else "case2_tracking"
    changes = {"controller.law": program.law, "controller.observer.enabled": program.observed}
    make_loop(load_scenario(name, changes), 2).advance(2)


def is_compiled(scenario: Scenario) -> bool:
    """Whether the runs of a scenario are compiled."""
    return available() and scenario.controller.law in compilable_laws()


def ensure_compiled(scenarios: Iterable[Scenario]) -> None:
    """Compile what scenarios need and what is not stored, before worker processes each begin to do so."""
    if not available():
        return
    known = compilable_laws()
    given = ((each.controller, each.vessel_sim.by_thrusters) for each in scenarios)
    for program in {Program(each.law, each.observer.enabled, by_thrusters) for each, by_thrusters in given}:
        if program.law in known and not _is_stored(program):
            compile_program(program)


def main(names: Sequence[str] = ()) -> None:
    """Compile what is not stored in two processes, and print what each has taken.

    `names`: of the laws, without the observer and with it; by default all that can be compiled, what is often used, and the
    references.
    """
    if not available():
        return
    wanted = [Program(name, observed) for name in names for observed in (False, True)]
    wanted = wanted or [*map(Program, compilable_laws()), *OFTEN]
    jobs: dict[str, Callable[[], object]] = {str(each): partial(compile_program, each) for each in wanted if not _is_stored(each)}
    ships = {} if names else {mode: load_scenario("waypoints", {"reference_ship.mode": mode}).reference_ship for mode in MODES}
    kernels = {mode: cast("Any", make_reference(ship, 0.01)).kernels for mode, ship in ships.items()}
    ships = {mode: ship for mode, ship in ships.items() if not compiled(follow, **kernels[mode]).stored}
    jobs |= {f"reference {mode}": partial(reference_of, ship, 100.0, 2) for mode, ship in ships.items()}
    if not jobs:
        return
    print("Compiling the control laws, about four minutes ...", flush=True)
    logging.disable(logging.WARNING)  # of each process, that it compiles
    with ProcessPoolExecutor(2, initializer=logging.disable, initargs=(logging.WARNING,)) as pool:
        running = {pool.submit(_timed, job): title for title, job in jobs.items()}
        for count, done in enumerate(as_completed(running), 1):
            print(f"{count} of {len(jobs)}: {running[done]}, {done.result():.1f} s", flush=True)


def _is_stored(program: Program) -> bool:
    return compiled_loop(compilable_laws()[program.law], program.observed, program.by_thrusters).stored


def _timed(job: Callable[[], object]) -> float:
    started = time.perf_counter()
    job()
    return time.perf_counter() - started


if __name__ == "__main__":
    main(sys.argv[1:])
