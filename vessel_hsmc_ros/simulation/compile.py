"""`python -m vessel_hsmc_ros.simulation.compile` compiles every law beforehand, in two processes, and keeps the machine code.

`make setup` calls it, so that the first simulation need not wait.
"""

import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor

from vessel_hsmc_ros.laws import LAWS
from vessel_hsmc_ros.laws.kernel_law import KernelLaw
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.compilation import available
from vessel_hsmc_ros.simulation.compiled_loop import make_loop
from vessel_hsmc_ros.simulation.undefined import is_compilable


def compilable_laws() -> list[str]:
    """The names of the laws that can be compiled."""
    classes = {name: LAWS[name].controller for name in LAWS}
    return [name for name, cls in classes.items() if issubclass(cls, KernelLaw) and is_compilable(cls)]


def compile_law(name: str) -> float:
    """Compile the loop with a law, unless it is stored; returns the time that it has taken, s."""
    started = time.perf_counter()
    make_loop(load_scenario("case2_tracking", {"controller.law": name}), 2).advance(2)
    return time.perf_counter() - started


def compile_laws(names: Sequence[str] = ()) -> None:
    """Compile laws in two processes, and print what each has taken.

    Args:
        names: Of the laws; all that can be compiled by default.
    """
    if not available():
        return
    chosen = list(names or compilable_laws())
    with ProcessPoolExecutor(min(2, len(chosen))) as pool:
        for name, duration in zip(chosen, pool.map(compile_law, chosen), strict=True):
            print(f"law {name}: {duration:.1f} s", flush=True)


if __name__ == "__main__":
    compile_laws(sys.argv[1:])
