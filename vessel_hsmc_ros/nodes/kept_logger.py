"""A logger that also passes its lines on.

In a file of its own: rclpy identifies a line by the place of its call, for its filters, and has to skip this file in doing so.
"""

from collections.abc import Callable
from os.path import realpath
from typing import Any

from rclpy.impl import rcutils_logger

rcutils_logger._internal_callers.append(realpath(__file__))


class KeptLogger(rcutils_logger.RcutilsLogger):  # type: ignore[misc]
    """A logger whose lines are kept.

    `keep`: called with severity, name and text of each line that is not filtered out.
    """

    def __init__(self, name: str, keep: Callable[[int, str, str], None]) -> None:
        super().__init__(name)
        self._keep = keep

    def log(self, message: str, severity: int, **options: Any) -> bool:
        """Log a line; returns whether it was not filtered out."""
        logged: bool = super().log(message, severity, **options)
        if logged:
            self._keep(int(severity), self.name, message)
        return logged
