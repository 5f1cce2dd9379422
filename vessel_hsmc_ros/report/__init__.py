"""Runs as people look at them: one page that needs nothing but itself, figures, tables for other programs."""

from vessel_hsmc_ros.hull import Hull
from vessel_hsmc_ros.report.bags import of_bag
from vessel_hsmc_ros.report.page import write
from vessel_hsmc_ros.report.series import Signal, Signals, of_run
from vessel_hsmc_ros.report.tables import ORIGIN, Record, rows

__all__ = ["ORIGIN", "Hull", "Record", "Signal", "Signals", "of_bag", "of_run", "rows", "write"]
