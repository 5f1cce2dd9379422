"""Mutated serialised messages at the inputs of the nodes: `python benchmarks/raw_messages.py [--only controller,goal]`.

Each node runs as a process of its own, in a namespace of its own, and receives mutated messages among valid ones. It must go on
running, answer valid messages, publish only finite values within its limits, keep its memory below 1 GiB, and end by SIGINT with
exit code 0. Exits with 1 if one does not.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "test" / "support"))

from raw_messages import TARGETS, attack


def survived(name: str, count: int, first: int) -> bool:
    """Attack one node and print the result."""
    began = time.monotonic()
    try:
        with tempfile.TemporaryDirectory() as folder, attack(name, Path(folder)) as attacked:
            attacked.send(count, first)
            attacked.check()
            code = attacked.stop()
    except AssertionError as error:
        print(f"{name}: {error}", flush=True)
        return False
    print(f"{name}: {count} mutated messages in {time.monotonic() - began:.0f} s, exit code {code}", flush=True)
    return code == 0


def main() -> int:
    """Attack all nodes, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=2000, help="number of mutated messages for each node")
    parser.add_argument("--only", default=",".join(TARGETS), help="nodes, separated by commas")
    parser.add_argument("--start", type=int, default=0, help="seed of the first message")
    arguments = parser.parse_args()
    results = [survived(name, arguments.messages, arguments.start) for name in arguments.only.split(",")]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
