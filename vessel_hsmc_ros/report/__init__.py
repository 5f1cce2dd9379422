"""Reports of runs: a self-contained HTML page, figures, and tables for other programs."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vessel_hsmc_ros.core.hull import Hull
    from vessel_hsmc_ros.report.from_bag import of_bag, of_fleet
    from vessel_hsmc_ros.report.page import write
    from vessel_hsmc_ros.report.record import ORIGIN, Record, analyse
    from vessel_hsmc_ros.report.tables import rows

__all__ = ["ORIGIN", "Hull", "Record", "analyse", "of_bag", "of_fleet", "rows", "write"]

_SOURCES = {
    **{"Hull": "core.hull", "ORIGIN": "report.record", "Record": "report.record", "of_bag": "report.from_bag"},
    **{"of_fleet": "report.from_bag", "rows": "report.tables", "analyse": "report.record", "write": "report.page"},
}


def __getattr__(name: str) -> Any:
    """Import a part when it is used: the libraries of pages and bags take as long as a short run."""
    if name not in _SOURCES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"vessel_hsmc_ros.{_SOURCES[name]}"), name)
