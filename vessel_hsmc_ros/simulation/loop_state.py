"""What the compiled closed loop takes, keeps and writes."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_filter import ObserverConstants, ObserverState
from vessel_hsmc_ros.control.pivot import Heading, Pivot
from vessel_hsmc_ros.core.delay_line import DelayLine
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState

Array = NDArray[np.float64]


class Constants(NamedTuple):
    """What stays constant during a run: of the law, the plant, the observer and the point that the law controls.

    `drive` is the way from the command to the hull, with states that are written in place: nothing, or a `ThrusterDrive`.
    """

    law: Any
    plant: PlantConstants
    observer: ObserverConstants
    pivot: Pivot
    drive: Any


class Inputs(NamedTuple):
    """What is known of every step before the run.

    Attributes:
        stamp: Times of the steps, (n,) ns.
        time: The same, (n,) s.
        due: Whether a control period begins, (n,).
        measured_at: Times of the measurements that odometry shows, (n,) ns.
        age: How much older than the step they are, (n,) s.
        behind: The same in control periods, rounded, (n,).
        latest: Index of the latest published motion of the reference, (n,).
        sampled: Whether position, heading and velocities are sampled, (n, 3).
        reference: Motions of the reference as published: x, y, psi, u, v, r, du, dv, dr, and psi as received, (m, 10).
        sensor_noise: Standard normal numbers of the sensors, (n, 6); none where they are perfect.
        gust_noise: Standard normal numbers of the gusts, (n, 2); none where no wind blows.
    """

    stamp: NDArray[np.int64]
    time: Array
    due: NDArray[np.bool_]
    measured_at: NDArray[np.int64]
    age: Array
    behind: NDArray[np.int64]
    latest: NDArray[np.int64]
    sampled: NDArray[np.bool_]
    reference: Array
    sensor_noise: Array
    gust_noise: Array


class State(NamedTuple):
    """What a step leaves to the next.

    Attributes:
        periods: Number of control periods so far.
        wrench: Commanded surge force [N] and yaw moment [N·m].
        memory: Internal state of the law.
        observer: State of the observer.
        plant: State of the plant.
        delta: State of the filter of the headings of `control.pivot`.
        commands: The last commands, where there is an observer.
    """

    periods: int
    wrench: tuple[float, float]
    memory: Any
    observer: ObserverState
    plant: PlantState
    delta: Heading
    commands: DelayLine


class Kept(NamedTuple):
    """What the loop writes; arrays without elements are left out.

    Attributes:
        rows: By the columns of `loop.WIDTHS`, (n, 35).
        brief: What metrics need instead of rows: x, y, psi minus those of the reference, applied wrench, command, (7, n).
        terms: Terms of the law, (m, t).
        weights: Weights of its networks, (m, k, l).
        estimates: x, y, psi, u, v, r of the observer, and psi as received, (m, 7).
        back: What the tracking errors at the origin exceed those at the pivot by, (m, 4).
    """

    rows: Array
    brief: Array
    terms: Array
    weights: Array
    estimates: Array
    back: Array
