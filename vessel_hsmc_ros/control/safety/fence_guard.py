"""The fence under way: brakes as soon as the vessel could no longer stop inside, then lets the law hold or return.

Every control period the place where the vessel comes to rest (`stopping`) is compared with the fence. When it touches the fence,
the law's wrench is not commanded any more:

| while | command |
|---|---|
| from the touch until the surge velocity has changed its sign | all of the surge force against the motion; the heading is held |
| after that, hold and return | the law's wrench for a reference at rest, on the way that the vessel has come |
| after that, brake | surge force in proportion to the motion and against it; the heading is held |

The first row is repeated where the vessel becomes faster than the brake itself leaves it, 2·a·t_d, and still could not stop.

The law steers back as it steers anywhere: it is the one that is tuned to the vessel, and no second one can disagree with it.
The way back is the vessel's own, which was free of obstacles when it came. The alarm ends once the vessel would stop inside and
the reference is inside as well, for RELEASE_TIME; a vessel outside of the fence never ends it.

Where a vessel comes to rest if it brakes now: a way and a radius about it that contain its path, in closed form.

| symbol | meaning | unit |
|---|---|---|
| U, v, r | magnitude of the surge velocity over ground, sway velocity, yaw rate | m/s, m/s, rad/s |
| a | largest surge force over the surge inertia m11 | m/s² |
| a_0 | acceleration by the surge force that acts now, positive along the motion | m/s² |
| T_d, T_l, R | dead time, lag and rate limit of the surge force, as an acceleration per second | s, s, m/s³ |
| t_d | mean delay of the braking force, with what the measurement and the control period are late | s |
| c, c_h, c_n, s_c | current over ground, along and across the hull, and the bound of the error of its estimate | m/s |
| b, f | decay rate of the surge velocity through the water; acceleration by what else acts, such as wind | 1/s, m/s² |
| g_0, g | acceleration along the motion by water and wind: now, and for a vessel at rest over ground | m/s² |
| d, t | braking distance and time | m, s |
| t_h | time constant with which the brake holds the heading | s |
| t_t | time in which the vessel turns into the current | s |

The command changes from a_0 to -a in one step, and the force follows it monotonically through dead time, lag and rate limit.
Such a force is a mixture of steps with delays tau. The velocity after a step that is late by tau is a concave function of tau, so
by Jensen's inequality it is at any time at most that after one step late by the mean, the area between force and command:

    t_d = late + T_d + T_l                                          if R·T_l >= a + a_0
    t_d = late + T_d + (a + a_0)/2R + R·T_l²/2(a + a_0)             else                                         (1)

Before that step the vessel accelerates by at most a_n = max(0, a_0 + g_0), so U_1 = U + a_n·t_d. At rest over ground the water
pushes by more than now, as the resistance has ended. Its chord from now to rest is at most DOUBT·b, or what the estimates give:

    g_0 = f + b·(c_h - U),   g = max(0, g_0 + DOUBT·b·U, f + DOUBT·b·c_h) + b·s_c                                (2)

In between the resistance grows with the first to the second power of the speed, of which the second is the less. With
(a - g + (g - g_0)·u²/U_1²)·dx = -u·du

    d = U·t_d + a_n·t_d²/2 + U_1²/(2·(g - g_0))·ln(1 + (g - g_0)/(a - g)),   t = t_d + U_1/(a - g)               (3)

Meanwhile it drifts sideways with the current. Its speed ahead falls and that sideways does not, so that the path is a bow in the
quadrangle p, q, e, f: between the tangents at its ends, and its chord after the delay. After that no force acts across the hull:
it drifts with the current until it has turned bow or stern to it, and for c²/(2·(a - g)) while it stops. With h and n along and
across the hull, and the largest circle in the quadrangle, which is at most twice its area over its perimeter,

    q = p + d·h + min(t, d/U)·c_n·n,   e = p + d·h + t·c_n·n,   f = p + t_d·c_n·n,   end = e + c·(t_t + |c|/(2·(a - g)))   (4)
    radius = inscribed + d·(|r|·min(t_h, t/2) + HEADING) + |v - c_n|·t + s_c·(t + t_t)
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.safety.monitors import Alarm, Monitor
from vessel_hsmc_ros.control.safety.parameters import FenceGuardParameters, Reason
from vessel_hsmc_ros.control.safety.supervision import Authority, Pair
from vessel_hsmc_ros.core.fence import Fence, allowed, clearance
from vessel_hsmc_ros.core.kernel import clip
from vessel_hsmc_ros.core.kinematics import TURN, Motion, to_body

DOUBT = 1.25  # factor by which the resistance may exceed that of the estimated decay rate
HEADING = 0.05  # deviation of the heading that the brake holds, rad
LEAST_HOLD = 0.05  # share of the surge force that must remain against current and wind; with less, a vessel cannot stop


class Braking(NamedTuple):
    """What a vessel can do against its motion."""

    deceleration: float  # a
    lag: float  # T_l
    dead_time: float  # T_d
    rate: float  # R; infinite for none
    turn_time: float  # t_t
    heading_time: float  # t_h
    late: float  # control period, s


class Water(NamedTuple):
    """What acts on the vessel."""

    current: complex = 0j  # c, over the earth
    doubt: float = 0.0  # s_c
    decay: float = 0.0  # b
    push: float = 0.0  # f, along the hull
    adverse: float = 0.0  # acceleration in any direction by what is not observed, m/s²


class Stop(NamedTuple):
    """Where a vessel comes to rest."""

    way: NDArray[np.complex128]  # p, q, e, f, p, e, end, (7,) m
    radius: float  # m
    distance: float  # d, m; infinite where it cannot stop
    time: float  # t, s
    delay: float  # t_d, s


def mean_delay(change: float, rate: float, lag: float) -> float:
    """The mean delay of a step through a lag with a rate limit, equation (1) without dead time, s."""
    if math.isinf(rate) or rate * lag >= change:
        return lag
    return 0.5 * change / rate + 0.5 * rate * lag * lag / change


def braking_distance(speed: float, net: float, resistance: float) -> float:
    """The distance in which a constant deceleration and a resistance at the speed stop a vessel, the last term of (3), m."""
    share = resistance / net
    return 0.5 * speed * speed / net * (math.log1p(share) / share if share > 1e-9 else 1.0)


def stop(motion: Motion, acting: float, age: float, braking: Braking, water: Water) -> Stop:
    """Where a vessel comes to rest, equations (1) to (4).

    `motion`: as measured. `acting`: surge force that acts now, over the inertia, m/s². `age`: of the measurement, s.
    """
    a, s, U = braking.deceleration, math.copysign(1.0, motion.u), abs(motion.u)
    c_h, c_n = to_body(water.current.real, water.current.imag, motion.psi)
    b, f, c_h = water.decay, s * water.push, s * c_h
    g_0 = f + b * (c_h - U)
    g = max(0.0, g_0 + DOUBT * b * U, f + DOUBT * b * c_h) + b * water.doubt + water.adverse
    a_0, net, p = max(s * acting, -a), a - g, complex(motion.x, motion.y)
    delay = age + braking.late + braking.dead_time + mean_delay(max(a + a_0, 1e-9), braking.rate, braking.lag)
    if net <= LEAST_HOLD * a:
        return Stop(np.full(7, p), math.inf, math.inf, math.inf, delay)
    a_n = max(0.0, a_0 + g_0)
    U_1 = U + a_n * delay
    d = U * delay + 0.5 * a_n * delay * delay + braking_distance(U_1, net, max(0.0, g - g_0))
    t, size = delay + U_1 / net, abs(water.current)
    after = braking.turn_time if size + water.doubt > 0.0 else 0.0
    heading = complex(math.cos(motion.psi), math.sin(motion.psi))
    q = p + heading * complex(s * d, c_n * min(t, d / max(U, 1e-9)))
    e = p + heading * complex(s * d, c_n * t)
    end = e + water.current * (after + 0.5 * size / net)
    f_p = p + 1j * heading * c_n * delay
    around = abs(q - p) + abs(e - q) + abs(f_p - e) + abs(p - f_p)
    inscribed = abs(((e - p).conjugate() * (f_p - q)).imag) / max(around, 1e-9)
    bent = abs(motion.r) * min(braking.heading_time, 0.5 * t) + HEADING
    radius = inscribed + d * bent + abs(motion.v - c_n) * t + water.doubt * (t + after)
    return Stop(np.array([p, q, e, f_p, p, e, end]), radius, d, t, delay)


MAX_CRUMBS = 1000  # places of the way back, a length apart
RELEASE_TIME = 5.0  # time for which vessel and reference must be inside before the law commands again, s
UNOBSERVED = 0.5  # share of the surge force that a declared current may take, where the law observes none


class FenceGuard(Monitor):
    """Watches the fence, and commands what keeps the vessel inside.

    `braking`: what the vessel can do. `authority`: its limits and inertia. `length`: of its hull, m.

    Attributes:
        stop: Where the vessel comes to rest; None before the first period.
        braking: What the vessel can do.
    """

    stop: Stop | None

    def __init__(
        self, parameters: FenceGuardParameters, fence: Fence, braking: Braking, authority: Authority, length: float
    ) -> None:
        self.parameters, self.fence, self.braking = parameters, fence, braking
        self._authority, self._length = authority, length
        self._margin = 0.5 * length if parameters.margin < 0.0 else parameters.margin
        self._crumbs: deque[complex] = deque(maxlen=MAX_CRUMBS)
        self._force = 0.0
        current = parameters.current
        self._water = Water(doubt=current, adverse=UNOBSERVED * braking.deceleration if current else 0.0)
        super().__init__(Reason.FENCE, 0.0, 0.0)

    def reset(self) -> None:
        """Forget the alarm; one that still holds is raised anew in the next period."""
        super().reset()
        self.stop, self.detail, self._touches = None, "", False
        self._heading = self._side = 0.0

    def step(
        self,
        motion: Motion,
        force: float,
        age: float,
        water: tuple[complex, float, float, float] | None,
        reference: Motion,
        period: float,
    ) -> Reason:
        """Watch a control period; returns FENCE while the law's own wrench must not be commanded.

        `motion`: of the vessel. `force`: surge force of the last command, N. `water`: as the law observes it; None for what it
        was before, and for the declared current, from anywhere, where it never does. `reference`: where the law would go.
        """
        acting = self._acting(force / self._authority.inertia[0], math.copysign(1.0, motion.u), period)
        self._water = self._water if water is None else Water(*water)
        self.stop = found = stop(motion, acting, age, self.braking, self._water)
        self._touches = not self._room(found.way) - found.radius > 0.0  # also where it is not a number
        if self.alarm is Alarm.SAFE:
            self._release(complex(reference.x, reference.y), period)
        elif self._touches:
            self.alarm, self.detail = Alarm.SAFE, self._explained(complex(motion.x, motion.y), found)
            self._side, self._heading = math.copysign(1.0, motion.u), motion.psi
            self._leave_fence(found)
        if self._side * motion.u <= 0.0:
            self._side = 0.0
        if self._touches and not self._side and abs(motion.u) > 2.0 * self.braking.deceleration * found.delay:
            self._side, self._heading = math.copysign(1.0, motion.u), motion.psi
        self._keep_way(complex(motion.x, motion.y))
        return Reason.FENCE if self.alarm is Alarm.SAFE else Reason.NONE

    def _release(self, goal: complex, period: float) -> None:
        """End the alarm once the vessel would stop inside and its reference is inside, for RELEASE_TIME."""
        good = not self._touches and self._room(np.array([goal, goal])) > 0.0
        self._absent = self._absent + period if good else 0.0
        if self._absent >= RELEASE_TIME:
            self.alarm, self.detail, self._absent = Alarm.OK, "", 0.0

    def _keep_way(self, p: complex) -> None:
        """Keep a place of the way, or on the way back, go on to the place before."""
        near = bool(self._crumbs) and abs(p - self._crumbs[-1]) < self._length
        if self.alarm is Alarm.OK and not near:
            self._crumbs.append(p)
        elif self.alarm is Alarm.SAFE and self.parameters.action == "return" and near and len(self._crumbs) > 1:
            self._crumbs.pop()

    def _acting(self, acceleration: float, side: float, period: float) -> float:
        """The largest surge force along the motion that may still act: a command that has ended fades with lag and dead time."""
        held = self.braking.lag + self.braking.dead_time
        self._force += (acceleration - self._force) * (1.0 if held <= 0.0 else -math.expm1(-period / held))
        return side * max(side * self._force, side * acceleration)

    def _room(self, way: np.ndarray) -> float:
        return clearance(self.fence, way) - self._margin

    def _leave_fence(self, found: Stop) -> None:
        """Drop the places of the way back at which the vessel could not be held inside of the fence."""
        needed = found.radius + float(abs(found.way[-1] - found.way[-2])) if math.isfinite(found.radius) else math.inf
        while len(self._crumbs) > 1 and self._room(np.array([self._crumbs[-1]] * 2)) < needed:
            self._crumbs.pop()

    def _explained(self, p: complex, found: Stop) -> str:
        away = clearance(self.fence, np.array([p, p]))
        if not allowed(self.fence, p):
            return f"the vessel at ({p.real:.6g}, {p.imag:.6g}) m is {-away:.1f} m outside"
        if math.isinf(found.distance):
            return f"current and wind use all of the surge force, so that the vessel cannot stop; the fence is {away:.1f} m away"
        reach = float(np.max(np.abs(found.way - p))) + found.radius
        return f"the vessel stops in {reach:.1f} m, the fence is {away:.1f} m away, with a margin of {self._margin:.1f} m"

    @property
    def reference(self) -> Motion | None:
        """The reference at rest to which the law returns; None while it follows its own."""
        if self.alarm is Alarm.OK or not self._crumbs:
            return None
        p = self._crumbs[-1]
        return Motion(p.real, p.imag, self._heading, 0.0, 0.0, 0.0)

    def command(self, demand: Pair | None, motion: Motion, period: float) -> Pair | None:
        """What is commanded instead of the law's own wrench; None without an alarm.

        `demand`: the law's wrench for `reference`; None where it has none.
        """
        found = self.stop
        if self.alarm is Alarm.OK or found is None:
            return None
        if not self._side and demand is not None and self.parameters.action != "brake":
            return demand
        a, t_h, t_u = self.braking.deceleration, self.braking.heading_time, max(2.0 * found.delay, period)
        turned = math.remainder(motion.psi - self._heading, TURN)
        surge = -a * self._side if self._side else clip(-motion.u / t_u, a)
        m = self._authority.inertia
        return m[0] * surge, -m[1] * (motion.r + 0.25 * turned / t_h) / t_h
