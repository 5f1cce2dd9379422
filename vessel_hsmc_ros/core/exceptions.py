"""Every error this package raises on purpose; each message is one line a user can act on."""


class VesselHsmcError(Exception):
    """Base of all errors raised by this package."""


class ParameterError(VesselHsmcError):
    """A parameter is unknown, has the wrong type or lies outside its range."""


class InstabilityError(ParameterError):
    """A gain makes the discretised surface dynamics unstable at the control period."""


class ScenarioError(VesselHsmcError):
    """A scenario cannot be found, read or run as it stands."""


class SimulationError(VesselHsmcError):
    """The plant or the loop around it cannot go on."""


class ControlError(VesselHsmcError):
    """The law has no value for this input."""


class GoalError(VesselHsmcError):
    """A goal or a path cannot be followed."""


class BackpressureError(VesselHsmcError):
    """A reader does not take what it is sent."""


class BagError(VesselHsmcError):
    """A bag cannot be written, read or repaired."""


class RunError(VesselHsmcError):
    """A run of the nodes did not end as it should."""


class ReportError(VesselHsmcError):
    """A report or an export cannot be made or written."""


class InstallationError(VesselHsmcError):
    """The package or a package it needs is not completely installed."""
