"""Reports of runs: a self-contained HTML page, figures, and tables for other programs."""

from vessel_hsmc_ros.core.hull import Hull
from vessel_hsmc_ros.report.from_bag import of_bag, of_fleet
from vessel_hsmc_ros.report.page import write
from vessel_hsmc_ros.report.record import ORIGIN, Record
from vessel_hsmc_ros.report.tables import rows
from vessel_hsmc_ros.report.verdict import with_verdict

__all__ = ["ORIGIN", "Hull", "Record", "of_bag", "of_fleet", "rows", "with_verdict", "write"]
