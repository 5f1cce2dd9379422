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
"""

import math
from collections import deque

import numpy as np

from vessel_hsmc_ros.control.safety.monitors import Alarm, Monitor
from vessel_hsmc_ros.control.safety.parameters import FenceGuardParameters
from vessel_hsmc_ros.control.safety.reasons import Reason
from vessel_hsmc_ros.control.safety.safe_action import Authority, Pair
from vessel_hsmc_ros.control.safety.stopping import Braking, Stop, Water, stop
from vessel_hsmc_ros.core.fence import Fence, allowed, clearance
from vessel_hsmc_ros.core.kinematics import TURN, Motion
from vessel_hsmc_ros.core.limits import clip

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

        `motion`: of the vessel. `force`: surge force of the last command, N. `age`: of the measurement, s. `water`: as the law
        observes it; None for what it was before, and for the declared current, from anywhere, where it never does. `reference`:
        where the law would go. `period`: s.
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
