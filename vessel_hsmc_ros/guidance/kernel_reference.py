"""References that are kernels: pure functions of a memory, which the node steps and a batch of runs compiles."""

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel

Array = NDArray[np.float64]


move: Any = None  # the kernels of a reference take the place of these two
read: Any = None


@kernel
def follow(memory: Any, constants: Any, rows: Array) -> None:
    """Write the motion of each step into rows of shape (n, 9)."""
    for k in range(len(rows)):
        memory = move(memory, constants) if k > 0 else memory
        motion, acceleration = read(memory, constants)
        for i in range(6):
            rows[k, i] = motion[i]
        for i in range(3):
            rows[k, 6 + i] = acceleration[i]


class KernelReference:
    """Holder of the memory of a reference; see `Reference` for the meaning of its methods."""

    move: ClassVar[Any]  # kernel (memory, constants) -> memory, one period later
    read: ClassVar[Any]  # kernel (memory, constants) -> state and accelerations
    constants: Any  # NamedTuple of what does not change during a run
    memory: Any  # NamedTuple of what does
    _read_from: Any = None
    _reading: tuple[Array, Array]

    @property
    def kernels(self) -> dict[str, Any]:
        """The kernels that `follow` calls."""
        return {"move": self.move, "read": self.read}

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
