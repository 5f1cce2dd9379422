"""The package's version, as it was installed; package.xml is where it is written."""

from importlib.metadata import version

__version__ = version("vessel_hsmc_ros")
