"""The way from the commanded wrench to the hull through thrust allocation and thrusters, for the compiled loop."""

from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.control.allocation import allocate, allocator, elapsed_time, new_state
from vessel_hsmc_ros.control.thruster_sets import THRUST, TURN, Allocator
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState
from vessel_hsmc_ros.plant.thruster_plant import apply_thrusts
from vessel_hsmc_ros.plant.thrusters import Thrusters, ThrusterState, idle, thrusters_of
from vessel_hsmc_ros.scenario.scenario import Scenario

NEVER = -1
"""The stamp of the last command before the first."""


class ThrusterDrive(NamedTuple):
    """Constants of allocation and thrusters, and their states, arrays that are written in place.

    Attributes:
        allocator, thrusters: The constants.
        allocation, now: The states of the allocation, (k, COLUMNS), and of the thrusters.
        last: Stamp of the last command, (1,) ns.
    """

    allocator: Allocator
    thrusters: Thrusters
    allocation: Any
    now: ThrusterState
    last: Any


def thruster_drive(scenario: Scenario, period: float) -> ThrusterDrive | tuple[()]:
    """The drive of a scenario before its first step; nothing where a wrench drives the ship.

    Args:
        scenario: The scenario.
        period: Of the plant, s.
    """
    if not scenario.vessel_sim.by_thrusters:
        return ()
    layout, known = scenario.vessel_sim.vessel.thrusters, scenario.thruster_allocation.vessel.thrusters
    constants = allocator(known)
    last = np.array([NEVER], np.int64)
    return ThrusterDrive(constants, thrusters_of(layout, period, np.array), new_state(constants), idle(layout), last)


@kernel
def drive_by_thrusters(
    stamp: int, plant: PlantState, wrench: tuple[float, float], surge_speed: float, c: PlantConstants, drive: ThrusterDrive
) -> PlantState:
    """The state of the plant with the wrench that its thrusters give for a command.

    Args:
        stamp: Of the command, ns.
        plant: State of the plant.
        wrench: Commanded surge force [N] and yaw moment [N·m].
        surge_speed: As measured, m/s.
        c: Constants of the plant.
        drive: Allocation and thrusters; their states are written.
    """
    last = drive.last[0]
    elapsed = elapsed_time(stamp, last) if last >= 0 else 0.0
    drive.last[0] = stamp
    allocate(wrench[0], wrench[1], elapsed, surge_speed, drive.allocator, drive.allocation)
    return apply_thrusts(plant, drive.allocation[:, THRUST], drive.allocation[:, TURN], c, drive.now, drive.thrusters)
