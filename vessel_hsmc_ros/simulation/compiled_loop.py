"""The closed loop compiled: the laws of the package, bit-identical to interpreted runs, some hundred times faster."""

from typing import Any

import numpy as np

from vessel_hsmc_ros.control.control_period import cause, period_of
from vessel_hsmc_ros.control.controlled_point import ERRORS
from vessel_hsmc_ros.control.observer import with_actuators
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import SimulationError, VesselHsmcError
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.law.kernel_law import KernelLaw
from vessel_hsmc_ros.law.law import Law
from vessel_hsmc_ros.plant.simulator import divergence_of_ship
from vessel_hsmc_ros.scenario.control import may_intervene
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law
from vessel_hsmc_ros.simulation.closed_loop import (
    DIVERGED,
    OUTDATED,
    UNDEFINED,
    advance,
    control_inputs,
    desired_motion,
    received,
)
from vessel_hsmc_ros.simulation.compilation import Compiled, available, compiled
from vessel_hsmc_ros.simulation.interpreted_loop import InterpretedLoop
from vessel_hsmc_ros.simulation.law_call import all_terms, is_compilable
from vessel_hsmc_ros.simulation.loop import BRIEF, WIDTH, Control, Evaluated, Loop
from vessel_hsmc_ros.simulation.loop_state import Kept, drive_by_thrusters
from vessel_hsmc_ros.simulation.preparation import prepare


def make_loop(
    scenario: Scenario, samples: int, law: Law[Any] | None = None, interpreted: bool = False, brief: Array | None = None
) -> Loop:
    """Make the loop of a scenario: compiled where its law can be, otherwise interpreted.

    Args:
        scenario: A scenario with a duration.
        samples: Number of rows of the complete run.
        law: A control law that replaces the scenario's.
        interpreted: Run interpreted in any case.
        brief: Array for what a compiled run that is only to be evaluated keeps, (BRIEF, samples).
    """
    law = law or make_law(scenario.controller)
    interpreted = interpreted or may_intervene(scenario.controller)  # the compiled loop has no supervision
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

    Args:
        scenario: A scenario with a duration.
        samples: Number of rows of the complete run.
        law: The law; it is reset.
        brief: Array for what its metrics need, (BRIEF, samples), instead of rows and all that the controller computes.

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
        periods = int(np.count_nonzero(self._inputs.due)) if brief is None else 0
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
        desired = desired_motion(inputs.reference, int(inputs.latest[k]))
        return cause(self._law, control_inputs(k, measured, desired, inputs), self._state.controller, controller)

    def control(self) -> Control:
        """What the controller has computed so far."""
        m = self._state.periods
        stamps = self._inputs.stamp[: self.done][self._inputs.due[: self.done]][:m]
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
        due = inputs.due[: self.done]
        command = brief[:, 5:7] if due.all() else brief[due, 5:7]
        return Evaluated(inputs.time[: self.done], brief[:, :3], brief[:, 3:5], command)

    def reference(self, count: int) -> Array:
        """The first published motions of the reference ship, (count, 9)."""
        return self._inputs.reference[:count, :9]
