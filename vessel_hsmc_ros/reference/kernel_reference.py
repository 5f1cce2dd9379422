"""References that are kernels: two pure functions of a memory, which the node steps and a batch of runs compiles."""

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class KernelReference:
    """Holder of the memory of a reference; see `Reference` for the meaning of its methods.

    Attributes:
        move: Kernel (memory, constants) -> memory, one period later.
        read: Kernel (memory, constants) -> state and accelerations.
        constants: NamedTuple of what does not change during a run.
        memory: NamedTuple of what does.
    """

    move: ClassVar[Any]
    read: ClassVar[Any]
    constants: Any
    memory: Any
    _read_from: Any = None
    _reading: tuple[Array, Array]

    @property
    def state(self) -> Array:
        """Pose x, y, psi and body velocities u, v, r of the present step, shape (6,)."""
        return self._present()[0]

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities at the present step, shape (3,): m/s², m/s², rad/s²."""
        return self._present()[1]

    def advance(self) -> None:
        """Advance by one period."""
        self.memory = self.move(self.memory, self.constants)

    def _present(self) -> tuple[Array, Array]:
        # The memory is a new tuple after every change, so its reading is computed once.
        if self._read_from is not self.memory:
            motion, acceleration = self.read(self.memory, self.constants)
            self._reading, self._read_from = (np.array(motion), np.array(acceleration)), self.memory
        return self._reading
