"""What is added to Numba has the results of CPython and NumPy; signals wait until machine code has returned."""

import math
import signal
import threading
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.core import kernel as kernels
from vessel_hsmc_ros.simulation.compilation import uninterrupted

numba = pytest.importorskip("numba")

QUARTERS = [0.25 * math.pi * k for k in range(-26, 27)]
DIVIDENDS = [*QUARTERS, *(math.nextafter(x, 9.0) for x in QUARTERS), -0.0, 1e300, 5e-324, math.inf, -math.inf, math.nan]
PAIRS = np.array([(x, y) for x in DIVIDENDS for y in (2.0 * math.pi, 1.0, -0.5, 3e-5, math.inf, 0.0, math.nan)])


def exact(x: float, y: float) -> float:
    return math.nan if math.isinf(x) or y == 0.0 else math.remainder(x, y)


EXPECTED = np.array([exact(x, y) for x, y in PAIRS.tolist()])


def test_the_remainder_of_compiled_kernels_is_that_of_python_also_half_way() -> None:
    from vessel_hsmc_ros.simulation import numba_additions

    implementation = numba_additions._remainder(1.0, 1.0)
    found = np.array([implementation(x, y) for x, y in PAIRS.tolist()])
    np.testing.assert_array_equal(found, EXPECTED)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(EXPECTED), "signs of zero")


A, COLUMN, ROW = np.arange(12.0).reshape(3, 4) + 0.1, np.array([[2.0], [3.0], [-5.0]]), np.array([0.3, -7.0, 11.0, 1e-3])
OPERATIONS: dict[str, tuple[str, tuple[Any, ...]]] = {
    "rows by a row": ("multiply", (A, ROW)),
    "a column by a row": ("multiply", (COLUMN, ROW)),
    "rows by a number": ("multiply", (A, 0.7)),
    "a row by a number": ("multiply", (ROW, 0.7)),
    "a row by a row": ("multiply", (ROW, ROW[::-1].copy())),
    "a sum of rows": ("add", (A, 3.0 * A[::-1].copy())),
    "an outer product": ("add_outer", (COLUMN, ROW)),
}


@pytest.mark.parametrize("name", OPERATIONS)
def test_the_loops_of_compiled_kernels_give_what_numpy_gives(name: str) -> None:
    from vessel_hsmc_ros.simulation import numba_additions

    operation, given = OPERATIONS[name]
    start = np.full((3, 4) if any(np.ndim(each) == 2 for each in given) else 4, 0.25)
    results = [start.copy(), start.copy()]
    scratch = (np.empty_like(start),) if operation == "add_outer" else ()
    typed = (numba.typeof(each) for each in (*given, start, *scratch))
    implementation = getattr(numba_additions, f"_{operation}")(*typed)
    for function, out in zip((getattr(kernels, operation), implementation), results, strict=True):
        function(*given, out, *scratch)
    np.testing.assert_array_equal(results[0], results[1])
    assert (results[0] != start).all()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_during_machine_code_is_handled_once_it_has_returned(number: signal.Signals) -> None:
    handled: list[int] = []

    def handler(given: int, _frame: object) -> None:
        handled.append(given)

    def machine_code(times: int) -> list[int]:
        for _ in range(times):
            signal.raise_signal(number)
        return list(handled)

    signal.signal(number, handler)
    for count in (1, 2):
        assert uninterrupted(machine_code, (1,)) == [number] * (count - 1), "not during it"
        assert handled == [number] * count
        assert signal.getsignal(number) is handler
    with pytest.raises(ZeroDivisionError):
        uninterrupted(lambda: 1 // 0, ())
    assert signal.getsignal(number) is handler


def test_outside_of_the_main_thread_machine_code_is_called_as_it_is() -> None:
    found: list[int] = []
    thread = threading.Thread(target=lambda: found.append(uninterrupted(lambda x: x + 1, (2,))))
    thread.start()
    thread.join(10.0)
    assert found == [3]
