"""Fuzz the readers of strangers' data: `python benchmarks/fuzz.py --examples 100000 [--only bag,csv] [--start 0]`.

Each target of test/support/fuzz_targets.py runs in a process of its own, one for each core at a time, which may take 1 GiB of
memory beyond what its libraries take, and has a deadline for each example. Its valid input must be accepted before it is mutated.
An example is known by its seed: `--only TARGET --start SEED --examples 1` repeats it.
Exits with 1 if there is a finding: a crash, a hang, memory beyond the limit, or a value accepted that must not be.
"""

import argparse
import faulthandler
import math
import multiprocessing
import os
import resource
import sys
import time
import traceback
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "test" / "support"))

from fuzz_seeds import seeds
from fuzz_targets import TARGETS
from mutation import mutated

MEMORY = 1 << 30
DEADLINE = 60
"""Time limit for an example, s; generous, for busy machines."""

SHARES = {"bag": 0.5, "unchecked_bag": 0.5, "message": 3.0}
"""Examples of a target beside those of the others, which have 1; a bag takes longer than a message."""


def virtual_memory() -> int:
    """Bytes of address space of this process."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")


def fuzz(name: str, first: int, count: int) -> None:
    """Run some examples of a target in this process, print what is found, and exit with 1 if that is anything."""
    target, seed = TARGETS[name], seeds()[name]
    if not target(seed):  # which also imports what it needs before the memory is limited
        sys.exit(f"{name}: its valid input is refused, so its mutations show nothing")
    limit = virtual_memory() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    accepted, found, begin = 0, 0, time.monotonic()
    for number in range(first, first + count):
        faulthandler.dump_traceback_later(DEADLINE, exit=True)
        try:
            accepted += target(mutated(seed, number))
        except Exception:
            found += 1
            print(f"{name} {number}:\n{traceback.format_exc(limit=-3)}", flush=True)
        faulthandler.cancel_dump_traceback_later()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
    pace = count / max(time.monotonic() - begin, 1e-9)
    print(f"{name}: {count} examples, {accepted} accepted, {found} findings, {peak} MiB at most, {pace:.0f} a second", flush=True)
    sys.exit(found > 0)


def run(name: str, first: int, count: int) -> bool:
    """Fuzz a target in a process of its own; returns whether nothing was found."""
    process = multiprocessing.get_context("spawn").Process(target=fuzz, args=(name, first, count))
    process.start()
    process.join()
    return process.exitcode == 0


def main() -> int:
    """Run all targets."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=100_000, help="number of examples over all targets")
    parser.add_argument("--only", default=",".join(TARGETS), help="targets, separated by commas")
    parser.add_argument("--start", type=int, default=0, help="seed of the first example of each target")
    arguments = parser.parse_args()
    names = arguments.only.split(",")
    if unknown := [name for name in names if name not in TARGETS]:
        parser.error(f"{unknown[0]} is not a target: those are {', '.join(TARGETS)}")
    whole = sum(SHARES.get(name, 1.0) for name in names)
    counts = [max(1, math.ceil(arguments.examples * SHARES.get(name, 1.0) / whole)) for name in names]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        sound = list(pool.map(run, names, [arguments.start] * len(names), counts))
    failed = [name for name, fine in zip(names, sound, strict=True) if not fine]
    print(f"findings in: {', '.join(failed)}" if failed else f"{sum(counts)} examples, no findings")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
