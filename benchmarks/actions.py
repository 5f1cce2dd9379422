"""Drawn sequences of goals, cancels, faults, holds and resets against the rules of the actions: each goal has one result.

What is checked of every answer stands in `test/support/drawn_tasks.py`; the suite runs some hundred of the same sequences.

    python benchmarks/actions.py [--sequences 100000] [--events 40] [--seed 0]
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

from rich.progress import track

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "support"))

from drawn_tasks import Sequence


def main() -> int:
    """Run the sequences and print how many results of each kind there were, and each sequence that breaks a rule."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sequences", type=int, default=100_000)
    parser.add_argument("--events", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    results: Counter[str] = Counter()
    broken, begun = 0, time.monotonic()
    for seed in track(range(arguments.seed, arguments.seed + arguments.sequences), "sequences"):
        drawn = Sequence(seed)
        try:
            drawn.run(arguments.events)
        except (AssertionError, LookupError) as error:
            broken += 1
            print(f"seed {seed}: {str(error).splitlines()[0] if str(error) else 'a rule is broken'}")
        results.update(code.name for code in drawn.results)
    print(f"{arguments.sequences} sequences, {results.total()} goals, {time.monotonic() - begun:.0f} s; {broken} break a rule")
    print(", ".join(f"{name} {count}" for name, count in results.most_common()))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
