"""`python -m vessel_hsmc_ros.simulation.compile` compiles every law beforehand, in two processes, and keeps the machine code.

`make setup` calls it, so that the first simulation need not wait.
"""

import logging
import sys
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from vessel_hsmc_ros.laws import LAWS
from vessel_hsmc_ros.laws.kernel_law import KernelLaw
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compilation import available
from vessel_hsmc_ros.simulation.compiled_loop import compiled_loop, make_loop
from vessel_hsmc_ros.simulation.undefined import is_compilable

OFTEN = ("guided", True)
"""The law that is often used with the observer."""


def compilable_laws() -> dict[str, type[KernelLaw[Any]]]:
    """The laws that can be compiled, by their names."""
    classes = {name: LAWS[name].controller for name in LAWS}
    return {name: cls for name, cls in classes.items() if issubclass(cls, KernelLaw) and is_compilable(cls)}


def compile_law(name: str, observed: bool = False) -> float:
    """Compile the loop with a law, unless it is stored.

    Args:
        name: Name of the law.
        observed: With the observer.

    Returns:
        The time that it has taken, s.
    """
    started = time.perf_counter()
    scenario = load_scenario("case2_tracking", {"controller.law": name, "controller.observer.enabled": observed})
    make_loop(scenario, 2).advance(2)
    return time.perf_counter() - started


def is_compiled(scenario: Scenario) -> bool:
    """Whether the runs of a scenario are compiled."""
    return available() and scenario.controller.law in compilable_laws()


def ensure_compiled(scenarios: Iterable[Scenario]) -> None:
    """Compile what scenarios need and what is not stored, before worker processes each begin to do so."""
    if not available():
        return
    known = compilable_laws()
    for name, observed in {(each.controller.law, each.controller.observer.enabled) for each in scenarios}:
        if name in known and not compiled_loop(known[name], observed).stored:
            compile_law(name, observed)


def main(names: Sequence[str] = ()) -> None:
    """Compile what is not stored in two processes, and print what each has taken.

    Args:
        names: Of the laws, without the observer and with it; by default all that can be compiled, the guided law also with it.
    """
    if not available():
        return
    known = compilable_laws()
    wanted = [(name, observed) for name in names for observed in (False, True)] or [*((name, False) for name in known), OFTEN]
    chosen = [(name, observed) for name, observed in wanted if not compiled_loop(known[name], observed).stored]
    if not chosen:
        return
    print("Compiling the control laws, about a minute ...", flush=True)
    logging.disable(logging.WARNING)  # of each process, that it compiles
    with ProcessPoolExecutor(2, initializer=logging.disable, initargs=(logging.WARNING,)) as pool:
        for (name, observed), duration in zip(chosen, pool.map(compile_law, *zip(*chosen, strict=True)), strict=True):
            print(f"law {name}{' with the observer' * observed}: {duration:.1f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
