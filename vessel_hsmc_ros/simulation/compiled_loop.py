"""The closed loop as one kernel, compiled: plant, reference, observer and law, step by step as in the nodes.

Its runs are bit-identical to interpreted ones, and some hundred times faster.
"""

from typing import Any

import numpy as np

from vessel_hsmc_ros.control.interface.kernel_law import KernelLaw
from vessel_hsmc_ros.control.interface.law import Law
from vessel_hsmc_ros.control.loop.control_period import ControlInputs, Period, cause, control_period, period_of
from vessel_hsmc_ros.control.loop.controlled_point import ERRORS
from vessel_hsmc_ros.control.loop.observer import with_actuators
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import SimulationError, VesselHsmcError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, published
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.plant.dynamics import Wrench, acceleration, unforced
from vessel_hsmc_ros.plant.simulator import divergence_of_ship
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState, apply, disturbance, is_finite, measure, shown
from vessel_hsmc_ros.plant.step import advance as advance_plant
from vessel_hsmc_ros.scenario.control import may_intervene
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law
from vessel_hsmc_ros.simulation.compilation import Compiled, available, compiled
from vessel_hsmc_ros.simulation.loop import BRIEF, WIDTH, Control, Evaluated, InterpretedLoop, Loop, all_terms, is_compilable
from vessel_hsmc_ros.simulation.preparation import Constants, Inputs, Kept, State, drive_by_thrusters, prepare

DONE, UNDEFINED, DIVERGED, OUTDATED = 0, 1, 2, 3
"""Why the loop has stopped: at the requested step, before a step at which the law has no finite wrench, after a step that ended
with a motion that is not finite, or after one after which the law needs other constants."""


@kernel
def drive(
    stamp: int,  # noqa: ARG001 - in the place of `drive_by_thrusters`
    plant: PlantState,
    wrench: tuple[float, float],
    surge_speed: float,  # noqa: ARG001
    c: PlantConstants,
    state: Any,  # noqa: ARG001
) -> PlantState:
    """Apply the command by the actuators of a wrench; where thrusters drive the ship, `drive_by_thrusters` takes this place."""
    return apply(plant, wrench, c)


@kernel
def write(row: Array, start: int, values: Any) -> None:
    """Write the elements of a tuple into a row."""
    for i in range(len(values)):
        row[start + i] = values[i]


@kernel
def desired_motion(reference: Array, i: int) -> Motion:
    """A motion of the reference as the controller receives it."""
    return Motion(reference[i, 0], reference[i, 1], reference[i, 9], reference[i, 3], reference[i, 4], reference[i, 5])


@kernel
def control_inputs(k: int, measured: Motion, desired: Motion, inputs: Inputs) -> ControlInputs:
    """What the control period of step k takes.

    `measured`, `desired`: states of ship and reference as their messages give them.
    """
    row = inputs.reference[inputs.schedule.latest[k]]
    rate = Acceleration(row[6], row[7], row[8])
    return ControlInputs(
        inputs.schedule.measured_at[k], inputs.schedule.age[k], inputs.schedule.behind[k], measured, desired, rate
    )


@kernel
def received(plant: PlantState, constants: PlantConstants) -> tuple[Motion, Motion]:
    """State and measurement as their messages give them."""
    state = published(plant.motion)
    return state, (state if constants.odometry_is_true else published(shown(plant, constants)))


@kernel
def keep(
    row: Array, time: float, received: tuple[Motion, Motion, Motion], wrench: Any, disturbing: Any, state: Any, c: Any
) -> None:
    """Write a row.

    Args:
        time: Time, s.
        received: State, measurement and reference as their messages give them.
        wrench: Commanded surge force [N] and yaw moment [N·m].
        disturbing: Disturbing wrench, N, N, N·m.
        state: State of the plant, with the wrench that its actuators apply.
    """
    row[0] = time
    for i in range(3):
        write(row, 1 + 6 * i, received[i])
    row[19], row[20] = state.tau[0], state.tau[2]
    write(row, 21, wrench)
    write(row, 23, acceleration(disturbing, c.vessel))
    write(row, 26, unforced(state.motion, c.vessel, c.current))
    row[29], row[30] = state.motion.psi, shown(state, c).psi
    write(row, 31, disturbing)
    row[34] = state.tau[1]


@kernel
def keep_brief(brief: Array, k: int, state: Motion, desired: Motion, tau: Wrench, wrench: tuple[float, float]) -> None:
    """Write a column of what metrics need.

    `brief`: the array, (7, n). `state`, `desired`: state and reference as their messages give them. `tau`: applied wrench, N,
    N, N·m. `wrench`: commanded surge force [N] and yaw moment [N·m].
    """
    brief[0, k], brief[1, k], brief[2, k] = state.x - desired.x, state.y - desired.y, state.psi - desired.psi
    brief[3, k], brief[4, k] = tau[0], tau[2]
    brief[5, k], brief[6, k] = wrench


@kernel
def advance(start: int, stop: int, state: State, constants: Constants, inputs: Inputs, kept: Kept) -> tuple[int, int, State]:
    """Steps start to stop - 1 of the loop.

    `start`, `stop`: indices of steps. `state`: what the step before `start` has left; its arrays are written in place. Returns
    why the loop has stopped, the number of rows that are done, and the state that they have left.
    """
    periods, plant, controller = state
    c, last = constants.plant, len(inputs.schedule.time) - 1
    for k in range(start, stop):
        time = inputs.schedule.time[k]
        disturbing = disturbance(time, c, plant)
        sampled = inputs.schedule.sampled[k]
        plant = measure(plant, sampled[0], sampled[1], sampled[2], inputs.sensor_noise[k], time, c)
        shown, measured = received(plant, c)
        desired = desired_motion(inputs.reference, inputs.schedule.latest[k])
        renewed = False
        if inputs.schedule.due[k]:
            period = control_period(control_inputs(k, measured, desired, inputs), controller, constants.controller)
            controller, renewed = period.state, period.is_outdated
            if not period.is_defined:
                return UNDEFINED, k, State(periods, plant, controller)
            keep_period(periods, period, kept)
            periods += 1
        plant = drive(inputs.schedule.stamp[k], plant, controller.wrench, measured.u, c, constants.drive)
        if len(kept.rows):
            keep(kept.rows[k], time, (shown, measured, desired), controller.wrench, disturbing, plant, c)
        else:
            keep_brief(kept.brief, k, shown, desired, plant.tau, controller.wrench)
        reason = OUTDATED if renewed else DONE
        if k < last:  # the last sample is the final state
            plant = advance_plant(plant, plant.tau, acceleration(disturbing, c.vessel), inputs.gust_noise[k], c)
            reason = reason if is_finite(plant.motion) else DIVERGED
        if reason != DONE:
            return reason, k + 1, State(periods, plant, controller)
    return DONE, stop, State(periods, plant, controller)


@kernel
def keep_period(k: int, period: Period, kept: Kept) -> None:
    """Write what the controller has computed in a control period.

    `period`: its result; the memory of the law has the weights that it has used.
    """
    if k < len(kept.terms):
        write(kept.terms[k], 0, period.terms)
        W = period.state.memory.W
        for i in range(len(W)):
            for j in range(W.shape[1]):
                kept.weights[k, i, j] = W[i, j]
    if k < len(kept.estimates):
        write(kept.estimates[k], 0, period.motion)
        kept.estimates[k, 6] = published(period.motion).psi
    if k < len(kept.back):
        write(kept.back[k], 0, period.back)


def make_loop(
    scenario: Scenario, samples: int, law: Law[Any] | None = None, interpreted: bool = False, brief: Array | None = None
) -> Loop:
    """Make the loop of a scenario: compiled where its law can be, otherwise interpreted.

    `brief`: array for what a compiled run that is only to be evaluated keeps, (BRIEF, samples).
    """
    law = law or make_law(scenario.controller)
    # The compiled loop has no supervision, and takes a reference that is known before the run.
    interpreted = interpreted or may_intervene(scenario.controller) or scenario.reference_ship.follow == "vessel"
    if not interpreted and isinstance(law, KernelLaw) and is_compilable(type(law)) and available():
        try:
            return CompiledLoop(scenario, samples, law, brief)
        except SimulationError:  # of the reference: interpreted, the run goes on until it occurs
            pass
    return InterpretedLoop(scenario, samples, law)


def compiled_loop(law: type[KernelLaw[Any]], observed: bool, by_thrusters: bool = False) -> Compiled:
    """The loop with a law, with the observer or without, driven by a wrench or by thrusters."""
    kernels: dict[str, Any] = {"control_period": period_of(law, observed)}
    if by_thrusters:
        kernels["drive"] = drive_by_thrusters
    title = f"the law {law.name}{' with thrusters' * by_thrusters}{' with the observer' * observed}"
    return compiled(advance, title, allocates=observed, **kernels)


class CompiledLoop(Loop):
    """Plant, reference ship and controller as one compiled kernel.

    `law`: the law; it is reset. `brief`: array for what its metrics need, (BRIEF, samples), instead of rows and all that the
    controller computes.

    Raises:
        SimulationError: the motion of the reference is no longer finite.
    """

    block = 50_000  # a call converts all arguments and results, which takes 0.1 ms

    def __init__(self, scenario: Scenario, samples: int, law: KernelLaw[Any], brief: Array | None = None) -> None:
        law.reset()
        self._scenario, self._law, self._grid = scenario, law, RateGrid(scenario.controller.rate_hz)
        self.samples, self.done = samples, 0
        self._state, self._constants, self._inputs = prepare(scenario, samples, law)
        self.rows = np.empty((samples if brief is None else 0, WIDTH))
        periods = int(np.count_nonzero(self._inputs.schedule.due)) if brief is None else 0
        control = self._constants.controller
        estimates = np.empty((periods if control.observer.enabled else 0, 7))
        terms, weights = np.empty((periods, len(law.terms._fields))), np.empty((periods, *law.memory.W.shape))
        back = np.empty((periods if control.point.x_p else 0, len(ERRORS)))
        brief = np.empty((BRIEF, 0)) if brief is None else brief
        self._kept = Kept(self.rows, brief, terms, weights, estimates, back)
        self._advance = compiled_loop(type(law), control.observer.enabled, scenario.vessel_sim.by_thrusters)

    def advance(self, stop: int) -> None:
        """Go on until `stop` rows are done."""
        reason = OUTDATED
        while reason == OUTDATED and self.done < stop:
            given = self._state, self._constants, self._inputs, self._kept
            reason, self.done, self._state = self._advance(self.done, stop, *given)
            controller, c = self._state.controller, self._constants.controller
            self._law.memory = controller.memory
            if reason == OUTDATED:
                self._law.renew()
                self._state = self._state._replace(controller=controller._replace(memory=self._law.memory))
                observer = with_actuators(c.observer, self._scenario.controller.observer, self._law.known)
                self._constants = self._constants._replace(controller=c._replace(law=self._law.constants, observer=observer))
        if reason == UNDEFINED:
            raise self._undefined()
        if reason == DIVERGED:
            sim = self._scenario.vessel_sim
            time = (self.done - 1) * RateGrid(sim.rate_hz).period
            raise divergence_of_ship(time, self._state.plant.tau, sim.vessel)

    def _undefined(self) -> VesselHsmcError:
        """The error of the law at the present step: the interpreted law finds its cause."""
        k, inputs, controller = self.done, self._inputs, self._constants.controller
        _, measured = received(self._state.plant, self._constants.plant)
        desired = desired_motion(inputs.reference, int(inputs.schedule.latest[k]))
        return cause(self._law, control_inputs(k, measured, desired, inputs), self._state.controller, controller)

    def control(self) -> Control:
        """What the controller has computed so far."""
        m = self._state.periods
        stamps = self._inputs.schedule.stamp[: self.done][self._inputs.schedule.due[: self.done]][:m]
        terms = all_terms(self._law, stamps, self._grid, self._kept.terms[:m], self._kept.weights[:m])
        if len(self._kept.back):
            terms |= {name: terms[name] + self._kept.back[:m, i] for i, name in enumerate(ERRORS)}
        estimates = self._kept.estimates[:m]
        if not len(estimates):
            return Control(stamps, terms, None, None)
        return Control(stamps, terms, estimates[:, :6], np.column_stack((estimates[:, :2], estimates[:, 6], estimates[:, 3:6])))

    def evaluated(self) -> Evaluated:
        """What the metrics of the steps so far need, of a run that keeps nothing else."""
        brief, inputs = self._kept.brief[:, : self.done].T, self._inputs
        due = inputs.schedule.due[: self.done]
        command = brief[:, 5:7] if due.all() else brief[due, 5:7]
        return Evaluated(inputs.schedule.time[: self.done], brief[:, :3], brief[:, 3:5], command)

    def reference(self, count: int) -> Array:
        """The first published motions of the reference ship, (count, 9)."""
        return self._inputs.reference[:count, :9]
