"""Parameters of a test of which some are tried at each change, and all by `make test-long`."""

from collections.abc import Iterable
from typing import Any

import pytest


def rest_long(values: Iterable[Any], quick: int = 1) -> list[Any]:
    """The values, of which those after the first few are long tests: what they cost is more than what each of them adds."""
    given = [
        value if hasattr(value, "marks") else pytest.param(*(value if isinstance(value, tuple) else (value,))) for value in values
    ]
    long = [pytest.param(*each.values, marks=[*each.marks, pytest.mark.long], id=each.id) for each in given[quick:]]
    return given[:quick] + long
