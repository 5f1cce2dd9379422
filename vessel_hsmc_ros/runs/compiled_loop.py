"""The closed loop as one kernel."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.control_loop import NO_WRENCH
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, published
from vessel_hsmc_ros.laws import guided, hierarchical
from vessel_sim_node.actuators import Actuator, actuate
from vessel_sim_node.disturbance import acceleration, body_wrench, total
from vessel_sim_node.integrate import rk4_step
from vessel_sim_node.plant import Vessel, unforced

Array = NDArray[np.float64]


class Plant(NamedTuple):
    vessel: Vessel
    surge: Actuator
    yaw: Actuator
    mean: tuple[float, float, float]
    frequency: float
    phase: float
    current: tuple[float, float]
    wind_mean: tuple[float, float]
    wind_lever: float
    gust_memory: float
    gust_innovation: float
    windy: bool
    true_odometry: bool
    measures_velocity: bool
    bias: Motion
    noise: Motion
    step: float
    substeps: int


class PlantState(NamedTuple):
    motion: Motion
    held: Motion
    tau: tuple[float, float]
    gust: tuple[float, float]


class Schedule(NamedTuple):
    time: Array
    due: Any
    reference_index: Any
    sampled: Any


@kernel
def disturbance(time: float, p: Plant, s: PlantState) -> tuple[float, float, float]:
    factor = 1.0 + math.sin(p.frequency * time + p.phase)
    wrench = p.mean[0] * factor, p.mean[1] * factor, p.mean[2] * factor
    if p.windy:
        wrench = total(wrench, body_wrench((p.wind_mean[0] + s.gust[0], p.wind_mean[1] + s.gust[1]), s.motion.psi, p.wind_lever))
    return wrench


@kernel
def measure(k: int, p: Plant, s: PlantState, sampled: Any, normal: Array) -> Motion:
    """The held sample with new channels."""
    m, b, n, h = s.motion, p.bias, p.noise, s.held
    x, y, psi, u, v, r = h
    if sampled[k, 0]:
        x, y = (m.x + b.x) + n.x * normal[k, 0], (m.y + b.y) + n.y * normal[k, 1]
    if sampled[k, 1]:
        psi = (m.psi + b.psi) + n.psi * normal[k, 2]
    if sampled[k, 2] and p.measures_velocity:
        u, v = (m.u + b.u) + n.u * normal[k, 3], (m.v + b.v) + n.v * normal[k, 4]
        r = (m.r + b.r) + n.r * normal[k, 5]
    return Motion(x, y, psi, u, v, r)


@kernel
def write(row: Array, start: int, values: Any) -> int:
    for i in range(len(values)):
        row[start + i] = values[i]
    return start + len(values)


@kernel
def loop(step, memory, g, neurons, p, s, schedule, reference, normal, gusts, rows, terms):
    wrench = NO_WRENCH
    n = len(schedule.time)
    j = 0
    for k in range(n):
        time = schedule.time[k]
        disturbing = disturbance(time, p, s)
        state = published(s.motion)
        measured = state
        if not p.true_odometry:
            held = measure(k, p, s, schedule.sampled, normal)
            s = PlantState(s.motion, held, s.tau, s.gust)
            measured = published(held)
        i = schedule.reference_index[k]
        desired = Motion(reference[i, 0], reference[i, 1], reference[i, 2], reference[i, 3], reference[i, 4], reference[i, 5])
        if schedule.due[k]:
            rate = Acceleration(reference[i, 6], reference[i, 7], reference[i, 8])
            wrench, t, memory = step(measured, desired, rate, memory, g, neurons)
            write(terms[j], 0, t)
            j += 1
        tau = actuate(s.tau[0], wrench[0], p.surge), actuate(s.tau[1], wrench[1], p.yaw)
        rate3 = acceleration(disturbing, p.vessel)
        row = rows[k]
        row[0] = time
        write(row, 1, state)
        write(row, 7, measured)
        write(row, 13, desired)
        write(row, 19, tau)
        write(row, 21, rate3)
        write(row, 24, unforced(s.motion, p.vessel, p.current))
        if k + 1 < n:
            motion = s.motion
            for _ in range(p.substeps):
                motion = rk4_step(motion, tau, rate3, p.vessel, p.step, p.current)
            gust = s.gust
            if p.windy:
                gust = (
                    p.gust_memory * gust[0] + p.gust_innovation * gusts[k, 0],
                    p.gust_memory * gust[1] + p.gust_innovation * gusts[k, 1],
                )
            s = PlantState(motion, s.held, tau, gust)
            if not (math.isfinite(motion.x) and math.isfinite(motion.u) and math.isfinite(motion.r)):
                return k
    return n
