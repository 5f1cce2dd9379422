"""Runs as people look at them: one page that needs nothing but itself, figures, tables for other programs."""

from vessel_hsmc_ros.core.hull import Hull
from vessel_hsmc_ros.report.from_bag import of_bag
from vessel_hsmc_ros.report.page import write
from vessel_hsmc_ros.report.signals import Signal, Signals, of_run
from vessel_hsmc_ros.report.tables import ORIGIN, Record, rows

__all__ = ["ORIGIN", "Hull", "Record", "Signal", "Signals", "of_bag", "of_run", "rows", "write"]
