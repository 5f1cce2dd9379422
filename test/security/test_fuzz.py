"""A short fuzz of every reader with fixed seeds; `python benchmarks/fuzz.py` is the long one."""

import pytest
from durations import rest_long
from fuzz_seeds import seeds
from fuzz_targets import TARGETS
from mutation import mutated

EXAMPLES = {"bag": 20, "unchecked_bag": 20, "metadata": 20, "campaign": 20}
OTHERS = 100


@pytest.mark.parametrize("name", rest_long(TARGETS))
def test_a_mutated_input_is_accepted_or_refused_in_one_line(name: str) -> None:
    assert TARGETS[name](seeds()[name]), "the valid input is accepted"
    for seed in range(EXAMPLES.get(name, OTHERS)):
        TARGETS[name](mutated(seeds()[name], seed))
