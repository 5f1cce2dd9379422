"""Drawn boats under way, all at once: hand drives and closed loops, with lags, noise, wind and current, wired right or reversed.

The motion is that of Fossen's model of a vessel in surge, sway and yaw, in arrays over the boats and without code of the package:

    M·dnu + C(nu)·nu + D(nu)·nu = (X, 0, N) + wind,   with velocities relative to the water
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.preflight.connection import WRONG, Connection, Endpoint, Topic
from vessel_hsmc_ros.preflight.expected import connection_of, values_of
from vessel_hsmc_ros.preflight.rules import judge
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names

STEP = 0.05
"""Step of the simulation, s."""

BOAT = {"m11": 550.0, "m22": 700.0, "m33": 700.0, "d_u": 70.0, "d_v": 300.0, "d_r": 400.0}
BOAT_LENGTH, BOAT_LIMITS = 5.0, (300.0, 250.0)
"""The boat of foreign_boat.py."""

LIMITS = {
    "cybership2": (2.0, 1.5),
    "cybership_enterprise": (2.0, 1.0),
    "gunnerus": (80e3, 500e3),
    "heron": (60.0, 20.0),
    "milliampere": (800.0, 700.0),
    "otter": (200.0, 50.0),
    "paper_ship": (200e3, 3e6),
    "supply_vessel": (1e6, 2e7),
    "viknes_830": (8e3, 6e3),
    "wam_v_16": (500.0, 400.0),
}
"""Force and moment with which each is driven, N and N·m."""

FLIPS = {"right": (1.0, 1.0), "force reversed": (-1.0, 1.0), "moment reversed": (1.0, -1.0), "both reversed": (-1.0, -1.0)}


class Boat(NamedTuple):
    """A drawn boat and how it is driven.

    Attributes:
        hull: Its name.
        drive: How it is driven.
        flip: Sign of the effect of force and of moment.
        seconds: Length of the record, from a time at which the boat may be under way.
        begin: s.
        every: Steps between two messages of odometry.
        lag, dead: Of the drives, s.
        noise: Standard deviations of x and y, psi, u and v, r.
        declared: Whether the noise is declared to the controller.
        current, wind: Speed, m/s, and share of the force limit; their directions.
        seed: Of noise and gusts.
    """

    hull: str
    drive: str
    flip: str
    seconds: float
    begin: float
    every: int
    lag: float
    dead: float
    noise: tuple[float, float, float, float]
    declared: bool
    current: tuple[float, float]
    wind: tuple[float, float]
    gusts: float
    seed: int


HAND = (
    "throttle up in turns",
    "throttle up before turns",
    "throttle down in turns",
    "zigzag, then faster",
    "constant throttle",
    "straight steps",
    "independent steps",
    "ahead and astern",
    "pulses",
)
BY_VELOCITY = ("steps by cmd_vel", "pulses by cmd_vel")
LOOPS = (
    "courses",
    "courses, speed by the way made good",
    "station keeping",
    "courses by cmd_vel",
    "courses by cmd_vel of the wrench",
)


def draw(seed: int, count: int, drives: Sequence[str] = HAND + BY_VELOCITY + LOOPS) -> list[Boat]:
    """Draw boats, half of them wired right."""
    rng = np.random.default_rng(seed)
    hulls = [*vessel_names(), "boat", "boat", "boat"]
    found = []
    for k in range(count):
        scale = rng.choice([0.0, 0.0, 0.1, 0.5, 1.0])
        noise = scale * rng.uniform(0.05, 0.5), scale * 0.02, scale * rng.uniform(0.0, 0.1), scale * 0.02
        windy = rng.choice([0.0, 1.0])
        found.append(
            Boat(
                str(rng.choice(hulls)),
                str(rng.choice(list(drives))),
                "right" if k % 2 == 0 else str(rng.choice(list(FLIPS)[1:])),
                float(rng.choice([8.0, 30.0, 60.0, 120.0, 240.0])),
                float(rng.choice([0.0, 20.0])),
                int(rng.choice([1, 2, 4])),
                float(rng.choice([0.0, 0.3, rng.uniform(0.0, 2.0)])),
                float(rng.choice([0.0, 0.0, rng.uniform(0.0, 1.0)])),
                noise,
                bool(rng.random() < 0.7),
                (windy * rng.uniform(0.0, 0.5), rng.uniform(0.0, 6.3)),
                (windy * rng.uniform(0.0, 0.3), rng.uniform(0.0, 6.3)),
                windy * rng.uniform(0.0, 0.15),
                int(rng.integers(2**31)),
            )
        )
    return found


def hull_of(name: str) -> tuple[dict[str, float], float, tuple[float, float]]:
    """Coefficients, length and limits of a hull."""
    if name == "boat":
        return BOAT, BOAT_LENGTH, BOAT_LIMITS
    ship = read_vessel(name)
    return ship.hull().coefficients()._asdict(), ship.hull().length, LIMITS[name]


class Fleet(NamedTuple):
    """What differs from boat to boat, each (n,)."""

    c: dict[str, Any]
    length: Any
    limits: tuple[Any, Any]
    flips: tuple[Any, Any]


def fleet_of(boats: Sequence[Boat]) -> Fleet:
    """The boats as arrays."""
    hulls = [hull_of(boat.hull) for boat in boats]
    names = {name for coefficients, _, _ in hulls for name in coefficients} | {"m23", "m32", "m_c", "d_u2", "d_u3", "d_r2"}
    c = {name: np.array([float(h[0].get(name, 0.0)) for h in hulls]) for name in names}
    flips = np.array([FLIPS[boat.flip] for boat in boats]).T
    limits = np.array([h[2] for h in hulls]).T
    return Fleet(c, np.array([h[1] for h in hulls]), (limits[0], limits[1]), (flips[0], flips[1]))


def rate(s: Any, fx: Any, wrench: tuple[Any, Any, Any], fleet: Fleet, current: tuple[Any, Any]) -> Any:
    """The rate of the states, (6, n), under a force of the drives and further wrenches."""
    c = fleet.c
    g = lambda name: c.get(name, 0.0)  # noqa: E731
    _, _, psi, ug, vg, r = s
    cos, sin = np.cos(psi), np.sin(psi)
    uc, vc = cos * current[0] + sin * current[1], -sin * current[0] + cos * current[1]
    u, v = ug - uc, vg - vc
    a, b, d = np.abs(u), np.abs(v), np.abs(r)
    lost_x = (g("d_u") + g("d_u2") * a + g("d_u3") * u * u) * u + (g("d_x_vv") * v + g("d_x_vr") * r) * v
    lost_y = (g("d_v") + g("d_v2") * b + g("d_v3") * v * v + g("d_y_rv") * d + g("d_y_uv") * a) * v
    lost_y = lost_y + (g("d_y_r") + g("d_y_rr") * d + g("d_y_vr") * b + g("d_y_ur") * u) * r
    lost_n = (g("d_r") + g("d_r2") * d + g("d_r3") * r * r + g("d_n_vr") * b + g("d_n_ur") * a) * r
    lost_n = lost_n + (g("d_n_v") + g("d_n_vv") * b + g("d_n_rv") * d + g("d_n_uv") * a) * v
    x = (c["m22"] * v + c["m_c"] * r) * r - lost_x + fx + wrench[0]
    y = -c["m11"] * u * r - lost_y + wrench[1]
    n = ((c["m11"] - c["m22"]) * v - c["m_c"] * r) * u - lost_n + wrench[2]
    det = c["m22"] * c["m33"] - c["m23"] * c["m32"]
    du, dv = x / c["m11"], (c["m33"] * y - c["m23"] * n) / det
    dr = (c["m22"] * n - c["m32"] * y) / det
    return np.array([cos * ug - sin * vg, sin * ug + cos * vg, r, du + r * vc, dv - r * uc, dr])


class Driver:
    """Commands of the boats at each step: drawn schedules and loops, each (n,).

    Args:
        boats: How each is driven.
        fleet: Their data.
    """

    def __init__(self, boats: Sequence[Boat], fleet: Fleet) -> None:
        self.drive = np.array([boat.drive for boat in boats])
        self.fleet, self.rng = fleet, np.random.default_rng([boats[0].seed, len(boats)])
        n = len(boats)
        slow = np.sqrt(fleet.length / 2.0).clip(0.7, 6.0)
        self.period = self.rng.uniform(18.0, 40.0, n) * slow
        self.short = self.rng.uniform(4.0, 8.0, n) * slow
        self.low, self.high = self.rng.uniform(0.1, 0.35, n), self.rng.uniform(0.4, 0.9, n)
        self.turn = self.rng.uniform(0.2, 0.6, n)
        self.steps = self.rng.uniform(-0.3, 1.0, (400, n)), self.rng.uniform(-0.6, 0.6, (400, n))
        self.speed = self.rng.uniform(0.3, 0.8, n) * self.cruise()
        self.course = np.cumsum(self.rng.choice([-1.0, 1.0], (400, n)) * self.rng.uniform(0.5, 2.4, (400, n)), axis=0)
        self.trim = np.zeros(n)
        self.sum = np.zeros(n)
        self.filtered: Any = None
        # Loops of the bandwidth that the drives carry.
        self.w = self.rng.uniform(0.15, 0.5, n) / slow

    def cruise(self) -> Any:
        """The speed that half the force gives, m/s."""
        c, force = self.fleet.c, 0.5 * self.fleet.limits[0]
        u = np.full(len(force), 0.5) * np.sqrt(self.fleet.length)
        for _ in range(60):
            u = 0.5 * u + 0.5 * force / (c["d_u"] + c["d_u2"] * u + c["d_u3"] * u * u).clip(1e-9)
        return np.minimum(u, 0.6 * np.sqrt(9.8 * self.fleet.length))

    def hand(self, t: float, like: str = "") -> tuple[Any, Any]:
        """Shares of force and moment by hand, of the drives of the boats or of one."""
        phase = (t % self.period) / self.period
        side = np.where((t // self.period) % 2 == 0, 1.0, -1.0)
        turning, early = phase > 0.6, phase > 0.45
        slot = (t // (0.5 * self.period)).astype(int) % 400
        each = np.arange(len(side))
        zig = np.where((t // self.short) % 2 == 0, 1.0, -1.0)
        low, high, turn = self.low, self.high, self.turn * side * turning
        straight = np.where((t // (0.4 * self.period)) % 2 == 0, low, high)
        astern = np.where(phase < 0.6, high, -0.8 * high)
        pulse = t % 12.0
        table = {
            "throttle up in turns": (np.where(turning, high, low), turn),
            "throttle up before turns": (np.where(early, high, low), turn),
            "throttle down in turns": (np.where(turning, low, high), turn),
            "zigzag, then faster": (np.where(t < 2 * self.period, low, high), self.turn * zig * (t > 1.6 * self.period)),
            "constant throttle": (low + 0.2, turn),
            "straight steps": (straight, 0.0 * low),
            "independent steps": (self.steps[0][slot, each], self.steps[1][(1.3 * slot).astype(int) % 400, each]),
            "ahead and astern": (astern, 0.5 * turn),
            "pulses": (high * (2.0 < pulse < 4.0), self.turn * (6.0 < pulse < 8.0)),
        }
        x, n = np.zeros(len(low)), np.zeros(len(low))
        for name, (force, moment) in table.items():
            mine = (self.drive == name) | (like == name)
            x, n = np.where(mine, force, x), np.where(mine, moment, n)
        return x, n

    def __call__(self, t: float, m: Any) -> tuple[Any, Any, Any, Any]:
        """Force, moment, and the velocities that are commanded, by a measurement m, (6, n)."""
        x, n = self.hand(t)
        force, moment = self.fleet.limits
        x, n = x * force, n * moment
        c, w = self.fleet.c, self.w
        self.filtered = m if self.filtered is None else self.filtered + STEP / (0.3 + STEP) * (m - self.filtered)
        px, py, psi, u, v, r = self.filtered
        slot = (t // self.period).astype(int) % 400
        wanted = self.course[slot, np.arange(len(px))]
        station = self.drive == "station keeping"
        along, across = np.cos(psi) * -px + np.sin(psi) * -py, np.arctan2(-py, -px)
        error = np.where(
            station, 0.3 * np.angle(np.exp(1j * (across - psi))) * (np.hypot(px, py) > 0.5), np.angle(np.exp(1j * (wanted - psi)))
        )
        top = 0.8 * np.minimum(moment / (c["d_r"] + c["d_r2"] * 0.3 + 1e-9 + 0.2 * c["m33"] * w), 0.6)
        r_wanted = np.clip(w * error, -top, top)
        u_wanted = np.where(
            station,
            np.clip(0.3 * w * along, -self.speed, self.speed),
            self.speed * (0.5 + 0.5 * np.cos(np.clip(error, -1.5, 1.5))),
        )
        made_good = self.drive == "courses, speed by the way made good"
        u_wanted = np.where(made_good, u_wanted + 0.2 * np.sin(0.3 * w * t) * self.speed, u_wanted)
        fx = (c["d_u"] + c["d_u2"] * np.abs(u_wanted)) * u_wanted + c["m11"] * 2.0 * w * (u_wanted - u)
        nz = (c["d_r"] + c["d_r2"] * np.abs(r_wanted)) * r_wanted + c["m33"] * 4.0 * w * (r_wanted - r)
        nz = nz - (c["m11"] - c["m22"]) * u * v
        loop = np.isin(self.drive, LOOPS)
        fx, nz = np.clip(fx, -force, force), np.clip(nz, -moment, moment)
        u_c, r_c = u_wanted, r_wanted
        of_wrench = self.drive == "courses by cmd_vel of the wrench"
        u_c = np.where(of_wrench, u + 0.5 * fx / c["m11"], u_c)
        r_c = np.where(of_wrench, r + 0.3 * nz / c["m33"], r_c)
        # By hand, velocities in the same steps as forces and moments.
        for drive, like in zip(BY_VELOCITY, ("independent steps", "pulses"), strict=True):
            share_x, share_n = self.hand(t, like)
            mine = self.drive == drive
            u_c, r_c = np.where(mine, share_x * self.speed, u_c), np.where(mine, share_n * top, r_c)
        return np.where(loop, fx, x), np.where(loop, nz, n), u_c, r_c


def sail(boats: Sequence[Boat]) -> list[Connection]:
    """The connections of the boats as `check` would observe them."""
    fleet = fleet_of(boats)
    n, longest = len(boats), max(boat.seconds + boat.begin for boat in boats)
    rng = np.random.default_rng([boats[0].seed, n])
    driver = Driver(boats, fleet)
    c, (force, moment) = fleet.c, fleet.limits
    lag = np.array([boat.lag for boat in boats])
    share = np.where(lag > 0.0, 1.0 - np.exp(-STEP / np.maximum(lag, 1e-9)), 1.0)
    dead = np.round(np.array([boat.dead for boat in boats]) / STEP).astype(int)
    noise = np.array([(b.noise[0], b.noise[0], b.noise[1], b.noise[2], b.noise[2], b.noise[3]) for b in boats]).T
    froude = np.sqrt(fleet.length / 2.0).clip(0.5, 2.0)
    polar = lambda pair: (pair[0] * np.cos(pair[1]), pair[0] * np.sin(pair[1]))  # noqa: E731
    cx, cy = (each * froude for each in polar(np.array([b.current for b in boats]).T))
    wx, wy = (each * force for each in polar(np.array([b.wind for b in boats]).T))
    gusts, gust = np.array([b.gusts for b in boats]), np.zeros((3, n))
    by_velocity = np.char.find(np.array([b.drive for b in boats]), "cmd_vel") >= 0
    s, act = np.zeros((6, n)), np.zeros((2, n))
    s[2] = rng.uniform(-3.0, 3.0, n)
    count = round(longest / STEP)
    queue = np.zeros((int(dead.max()) + 1, 2, n))
    states, commands = np.zeros((count, 6, n)), np.zeros((count, 4, n))
    for k in range(count):
        m = s + noise * rng.standard_normal((6, n))
        fx, nz, u_c, r_c = driver(k * STEP, m)
        states[k], commands[k] = m, (fx, nz, u_c, r_c)
        # The stack's own loops take velocities that are theirs, without noise.
        flip_u, flip_r = fleet.flips
        loop_x = c["d_u"] * u_c + c["m11"] / 0.5 * (flip_u * u_c - s[3]) * 1.0
        loop_n = c["d_r"] * r_c + c["m33"] / 0.3 * (flip_r * r_c - s[5])
        fx = np.where(by_velocity, np.clip(loop_x, -force, force), flip_u * fx)
        nz = np.where(by_velocity, np.clip(loop_n, -moment, moment), flip_r * nz)
        queue[k % len(queue)] = fx, nz
        late = queue[(k - dead) % len(queue), :, np.arange(n)].T if len(queue) > 1 else queue[0]
        act += share * (late - act)
        gust += STEP / 5.0 * -gust + np.sqrt(2.0 * STEP / 5.0) * rng.standard_normal((3, n))
        cos, sin = np.cos(s[2]), np.sin(s[2])
        blown = cos * wx + sin * wy + gusts * force * gust[0], -sin * wx + cos * wy + gusts * force * gust[1]
        wrench = blown[0], blown[1], act[1] + gusts * moment * gust[2]
        half = s + 0.5 * STEP * rate(s, act[0], wrench, fleet, (cx, cy))
        s = s + STEP * rate(half, act[0], wrench, fleet, (cx, cy))
    return [connection(b, k, states, commands, fleet) for k, b in enumerate(boats)]


def connection(boat: Boat, k: int, states: Any, commands: Any, fleet: Fleet) -> Connection:
    """The record of one of the boats."""
    part = slice(round(boat.begin / STEP), round((boat.begin + boat.seconds) / STEP))
    motions, sent = states[part, :, k][:: boat.every], commands[part, :, k]
    stamps, at = 1e3 + STEP * boat.every * np.arange(len(motions)), 1e3 + STEP * np.arange(len(sent))
    noise = (boat.noise[0], boat.noise[1]) if boat.declared else (0.01, 0.001)
    ship = float(fleet.length[k]), float(fleet.c["m11"][k]), float(fleet.c["m33"][k])
    velocities = sent[:, 2:] if "cmd_vel" in boat.drive else None
    return recorded(ship, (stamps, motions), (at, sent[:, :2], velocities), noise if boat.noise[0] > 0.0 else None, boat.seed)


def recorded(
    ship: tuple[float, float, float],
    motion: tuple[Any, Any],
    sent: tuple[Any, Any, Any],
    noise: tuple[float, float] | None,
    seed: int,
) -> Connection:
    """A connection as `check` observes it.

    Args:
        ship: Length and inertias of surge and yaw.
        motion: Times and x, y, psi, u, v, r.
        sent: Times, wrenches, and velocities where these are commanded.
        noise: That of positions and headings, as it is declared to an observer; None without one.
        seed: Of the times of receipt.
    """
    stamps, motions = motion
    at, wrenches, velocities = sent
    n = len(stamps)
    received = np.sort(stamps + np.random.default_rng(seed).uniform(0.005, 0.02, n))
    text = {name: np.array([word] * n, dtype=object) for name, word in (("frame", "odom"), ("child", "base_link"))}
    numbers = dict(zip(("x", "y", "psi", "u", "v", "r"), np.array(motions).T, strict=True))
    numbers["psi"] = np.angle(np.exp(1j * numbers["psi"]))
    ones = {"norm": np.ones(n), "up": np.ones(n), "variance": np.zeros(n), "least_variance": np.zeros(n)}
    command = {"stamp": at, "force": wrenches[:, 0], "moment": wrenches[:, 1]}
    topics = {
        "/odom": Topic(
            "/odom", (Endpoint("driver", types.ODOMETRY),), (), received, {"stamp": stamps, **text, **numbers, **ones}
        ),
        "/cmd_wrench": Topic("/cmd_wrench", (Endpoint("controller", types.WRENCH),), (), at, command),
    }
    parameters: dict[str, Any] = dict(zip(("vessel.length", "vessel.surge_inertia", "vessel.yaw_inertia"), ship, strict=True))
    if noise is not None:
        parameters |= {"observer.enabled": True, "observer.position_noise": noise[0], "observer.heading_noise": noise[1]}
    values: dict[str, Any] = {"controller": parameters}
    if velocities is not None:
        values["drive"] = {"form": "cmd_vel"}
        columns = {"stamp": at, "u": velocities[:, 0], "r": velocities[:, 1]}
        topics["/cmd_vel"] = Topic("/cmd_vel", (Endpoint("drive", types.TWIST_STAMPED),), (), at, columns)
    return connection_of(values_of(None, values), {}, topics=topics, is_live=False, events=("stop",), reasons=("OVERDUE",))


SIGNS = {"sign of force": "force", "sign of speed": "force", "sign of moment": "moment", "sign of rate": "moment"}
ABSENT = ("reference", "odometry")
"""What the records lack: a reference, and an odometry that is as fast as the loop needs."""


def judged(boat: Boat, record: Connection) -> tuple[list[tuple[str, bool, str]], list[str]]:
    """The verdicts on the signs, whether each is wired right, and what else is called wrong although it is right."""
    right = dict(zip(("force", "moment"), (sign > 0.0 for sign in FLIPS[boat.flip]), strict=True))
    found = judge(record)
    signs = [(SIGNS[each.about], right[SIGNS[each.about]], each.level) for each in found if each.about in SIGNS]
    # That a boat goes astern under a force ahead is named as well.
    named = (*ABSENT, *SIGNS, *(() if right["force"] else ("direction",)))
    return signs, [f"{each.about}: {each.text}" for each in found if each.level == WRONG and each.about not in named]


def judged_right(record: Connection) -> tuple[list[tuple[str, bool, str]], list[str]]:
    """`judged` of a boat that is wired right."""
    return judged(draw(1, 1)[0]._replace(flip="right"), record)
