"""A short fuzz of every reader with fixed seeds; `python benchmarks/fuzz.py` is the long one."""

import pytest
from fuzz_targets import TARGETS, mutated, seeds

EXAMPLES = {"bag": 8, "unchecked_bag": 8, "metadata": 20, "message": 20, "campaign": 20}
OTHERS = 60


@pytest.mark.parametrize("name", TARGETS)
def test_a_mutated_input_is_accepted_or_refused_in_one_line(name: str) -> None:
    for seed in range(EXAMPLES.get(name, OTHERS)):
        TARGETS[name](mutated(seeds()[name], seed))
