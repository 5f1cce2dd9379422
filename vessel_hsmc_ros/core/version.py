"""The version of the installed package; its source is package.xml."""

from importlib.metadata import version

__version__ = version("vessel_hsmc_ros")
