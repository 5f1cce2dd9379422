"""The closed loop compiled: the laws of the package, bit-identical to interpreted runs, some hundred times faster."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_filter import estimate
from vessel_hsmc_ros.control.pivot import ERRORS, carry
from vessel_hsmc_ros.core.exceptions import SimulationError, VesselHsmcError
from vessel_hsmc_ros.core.kinematics import Acceleration
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.laws import Law
from vessel_hsmc_ros.laws.kernel_law import KernelLaw
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law
from vessel_hsmc_ros.simulation.closed_loop import DIVERGED, UNDEFINED, Kept, advance, desired_motion, received, unobserved
from vessel_hsmc_ros.simulation.compilation import Compiled, available, compiled
from vessel_hsmc_ros.simulation.interpreted_loop import InterpretedLoop
from vessel_hsmc_ros.simulation.law_terms import all_terms
from vessel_hsmc_ros.simulation.loop import WIDTH, Control, Loop
from vessel_hsmc_ros.simulation.preparation import prepare
from vessel_hsmc_ros.simulation.undefined import cause, is_compilable
from vessel_sim_node.simulator import divergence_of_ship

Array = NDArray[np.float64]


def make_loop(
    scenario: Scenario, samples: int, law: Law[Any] | None = None, interpreted: bool = False, rows: Array | None = None
) -> Loop:
    """Make the loop of a scenario: compiled where its law can be, otherwise interpreted.

    Args:
        scenario: A scenario with a duration.
        samples: Number of rows of the complete run.
        law: A control law that replaces the scenario's.
        interpreted: Run interpreted in any case.
        rows: Array for the rows of a compiled run that is only to be evaluated, (samples, BRIEF).
    """
    law = law or make_law(scenario.controller)
    if not interpreted and isinstance(law, KernelLaw) and is_compilable(type(law)) and available():
        try:
            return CompiledLoop(scenario, samples, law, rows)
        except SimulationError:  # of the reference: interpreted, the run goes on until it occurs
            pass
    return InterpretedLoop(scenario, samples, law)


def compiled_loop(law: type[KernelLaw[Any]], observed: bool) -> Compiled:
    """The loop with a law, and with the observer or without."""
    if observed:
        return compiled(advance, f"the law {law.name} with the observer", law_step=law.kernel)
    return compiled(advance, f"the law {law.name}", allocates=False, law_step=law.kernel, observe=unobserved)


class CompiledLoop(Loop):
    """Plant, reference ship and controller as one compiled kernel.

    Args:
        scenario: A scenario with a duration.
        samples: Number of rows of the complete run.
        law: The law; it is reset.
        rows: Array for its rows; with BRIEF columns only, nothing of the controller is kept. By default it makes one.

    Raises:
        SimulationError: the motion of the reference is no longer finite.
    """

    block = 2000

    def __init__(self, scenario: Scenario, samples: int, law: KernelLaw[Any], rows: Array | None = None) -> None:
        law.reset()
        self._scenario, self._law, self._grid = scenario, law, RateGrid(scenario.controller.rate_hz)
        self.samples, self.done = samples, 0
        self._state, self._constants, self._inputs = prepare(scenario, samples, law)
        self.rows = np.empty((samples, WIDTH)) if rows is None else rows
        periods = int(np.count_nonzero(self._inputs.due)) if self.rows.shape[1] == WIDTH else 0
        estimates = np.empty((periods if self._constants.observer.enabled else 0, 7))
        terms, weights = np.empty((periods, len(law.terms._fields))), np.empty((periods, *law.memory.W.shape))
        back = np.empty((periods if self._constants.pivot.x_p else 0, len(ERRORS)))
        self._kept = Kept(self.rows, terms, weights, estimates, back)
        self._advance = compiled_loop(type(law), self._constants.observer.enabled)

    def advance(self, stop: int) -> None:
        """Go on until `stop` rows are done."""
        given = self._state, self._constants, self._inputs, self._kept
        reason, self.done, self._state = self._advance(self.done, stop, *given)
        self._law.memory = self._state.memory
        if reason == UNDEFINED:
            raise self._undefined()
        if reason == DIVERGED:
            sim = self._scenario.vessel_sim
            time = (self.done - 1) * RateGrid(sim.rate_hz).period
            raise divergence_of_ship(time, self._state.plant.tau, sim.vessel)

    def _undefined(self) -> VesselHsmcError:
        """The error of the law at the present step: the interpreted law finds its cause."""
        _, motion = received(self._state.plant, self._constants.plant)
        if self._constants.observer.enabled:
            motion = estimate(self._state.observer)
        reference, i = self._inputs.reference, int(self._inputs.latest[self.done])
        rate = Acceleration(*reference[i, 6:9].tolist())
        at = carry(motion, desired_motion(reference, i), rate, self._state.delta, self._constants.pivot)
        return cause(self._law, at.motion, at.desired, at.acceleration)

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

    def reference(self, count: int) -> Array:
        """The first published motions of the reference ship, (count, 9)."""
        return self._inputs.reference[:count, :9]
