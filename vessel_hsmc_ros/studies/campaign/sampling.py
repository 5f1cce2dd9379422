"""Points of the unit cube from which the parameters of the draws are made, each a pure function of its number."""

import warnings
from functools import lru_cache

import numpy as np
from scipy.stats import qmc

from vessel_hsmc_ros.core.kernel import Array

METHODS = ("random", "latin_hypercube", "sobol")

MAX_RUNS = 2**30  # largest number of draws: the length of the Sobol sequence
SEEDS = 2**31  # number of the seeds that the plant accepts
_BLOCK = 1024
_SMALLEST = 2.0**-53
_STREAM = 1  # separates the random numbers of a draw from those that the plant makes from its seed


def point(method: str, dimensions: int, seed: int, draws: int, draw: int) -> tuple[float, ...]:
    """A point of the open unit cube.

    `draws`: number of all draws, on which only those of latin_hypercube depend. Returns the coordinates, between 0 and 1 and
    neither of them.
    """
    if method == "latin_hypercube":
        row = _hypercube(dimensions, seed, draws)[draw]
    else:
        row = _block(method, dimensions, seed, draw // _BLOCK)[draw % _BLOCK]
    # The inverse of a normal distribution is infinite at 0 and 1.
    return tuple(min(max(u, _SMALLEST), 1.0 - _SMALLEST) for u in row.tolist())


def noise_seed(seed: int, draw: int) -> int:
    """Seed of the plant's random numbers in a draw; all draws of a campaign have different ones."""
    first = int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])
    return (first + draw) % SEEDS


@lru_cache(maxsize=4)
def _hypercube(dimensions: int, seed: int, draws: int) -> Array:
    """The table of a Latin hypercube, (draws, dimensions): its rows cannot be made one by one."""
    return np.asarray(qmc.LatinHypercube(dimensions, rng=np.random.default_rng(seed)).random(draws))


@lru_cache(maxsize=8)
def _block(method: str, dimensions: int, seed: int, number: int) -> Array:
    """A block of consecutive points, (_BLOCK, dimensions)."""
    first = number * _BLOCK
    if method == "random":
        return np.array([np.random.default_rng((seed, k, _STREAM)).random(dimensions) for k in range(first, first + _BLOCK)])
    sequence = qmc.Sobol(dimensions, rng=np.random.default_rng(seed))
    if first:
        sequence.fast_forward(first)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of the balance of a number that is no power of two
        # A point is the lower corner of its cell; the middle of the cell is never on the border of the cube.
        return np.asarray(sequence.random(_BLOCK)) + 0.5 / MAX_RUNS
