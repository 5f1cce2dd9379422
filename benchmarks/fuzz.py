"""Fuzz the readers of strangers' data: `python benchmarks/fuzz.py --examples 100000 [--only bag,csv] [--start 0]`.

Each target of test/support/fuzz_targets.py runs in a process of its own, which may take 1 GiB of memory beyond what its libraries
take, and has a deadline for each example. An example is known by its seed: `--only TARGET --start SEED --examples 1` repeats it.
Exits with 1 if there is a finding: a crash, a hang, memory beyond the limit, or a value accepted that must not be.
"""

import argparse
import faulthandler
import multiprocessing
import os
import resource
import sys
import time
import traceback
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "test" / "support"))

from fuzz_targets import TARGETS, mutated, seeds

MEMORY = 1 << 30
DEADLINE = 60
"""Time limit for an example, s; generous, for busy machines."""

SHARES = {"bag": 0.2, "unchecked_bag": 0.2, "metadata": 0.5, "message": 3.0}
"""Examples of a target beside those of the others, which have 1; a bag takes longer than a message."""


def virtual_memory() -> int:
    """Bytes of address space of this process."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")


def fuzz(name: str, first: int, count: int) -> None:
    """Run some examples of a target in this process, print what is found, and exit with 1 if that is anything."""
    os.nice(10)
    target, seed = TARGETS[name], seeds()[name]
    target(seed)  # imports what it needs before the memory is limited
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
        if sys.stdout.isatty() and number % 100 == 0:
            print(f"\r{name} {number - first} of {count}", end="", flush=True)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
    pace = count / max(time.monotonic() - begin, 1e-9)
    print(
        f"\r{name}: {count} examples, {accepted} accepted, {found} findings, {peak} MiB at most, {pace:.0f} a second", flush=True
    )
    sys.exit(found > 0)


def main() -> int:
    """Run all targets one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=100_000, help="number of examples over all targets")
    parser.add_argument("--only", default=",".join(TARGETS), help="targets, separated by commas")
    parser.add_argument("--start", type=int, default=0, help="seed of the first example of each target")
    arguments = parser.parse_args()
    names = arguments.only.split(",")
    whole = sum(SHARES.get(name, 1.0) for name in names)
    context, failed = multiprocessing.get_context("spawn"), []
    for name in names:
        count = max(1, round(arguments.examples * SHARES.get(name, 1.0) / whole))
        process = context.Process(target=fuzz, args=(name, arguments.start, count))
        process.start()
        process.join()
        if process.exitcode:
            failed.append(name)
    print(f"findings in: {', '.join(failed)}" if failed else "no findings")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
