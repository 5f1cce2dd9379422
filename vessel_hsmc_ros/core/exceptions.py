"""All errors that this package raises deliberately; every message is one line that names the problem and the remedy."""

MAX_MESSAGE_LENGTH = 4000  # characters of the longest error message


class VesselHsmcError(Exception):
    """Base of all errors raised by this package.

    Its text is one line of printable characters, whatever the names and values from files are that it quotes.
    """

    def __init__(self, *parts: object) -> None:
        super().__init__(*(_one_line(part) if isinstance(part, str) else part for part in parts))


class ParameterError(VesselHsmcError):
    """A parameter is unknown, has the wrong type or lies outside its range."""


class InstabilityError(ParameterError):
    """A gain makes the discretised surface dynamics unstable at the control period."""


class ScenarioError(VesselHsmcError):
    """A scenario cannot be found or read, or is inconsistent."""


class SimulationError(VesselHsmcError):
    """The plant or the closed loop cannot continue."""


class ControlError(VesselHsmcError):
    """The control law is undefined for this input."""


class LawError(ControlError):
    """The code of a control law is wrong: it raised an exception, or returned something else than a wrench and terms."""


class RefusalError(VesselHsmcError):
    """A node cannot do now what a person requested, such as commanding the ship while an input is missing."""


class GoalError(VesselHsmcError):
    """A goal or a path cannot be followed."""


class BackpressureError(VesselHsmcError):
    """A subscriber is slower than its publisher and its queue is full."""


class BagError(VesselHsmcError):
    """A bag cannot be written, read or repaired."""


class NoBagError(BagError):
    """There is no bag at a path that was given."""


class BagWarning(UserWarning):
    """The files of a bag are not those that its metadata.yaml names, or its content contradicts itself."""


class RunError(VesselHsmcError):
    """A run of the nodes did not complete."""


class CampaignError(VesselHsmcError):
    """The dataset of a campaign is in use, damaged or that of another one, or its runs cannot be computed."""


class IdentificationError(VesselHsmcError):
    """Measurements cannot be read, or do not determine the ship."""


class ReportError(VesselHsmcError):
    """A report or an export cannot be made or written."""


class InstallationError(VesselHsmcError):
    """The package or a package it needs is not completely installed."""


def _one_line(text: str) -> str:
    """A text without line breaks and control characters, which could command a terminal, and of limited length."""
    if len(text) > MAX_MESSAGE_LENGTH:
        text = text[:MAX_MESSAGE_LENGTH] + " ..."
    return text if text.isprintable() else "".join(c if c.isprintable() else " " if c.isspace() else "?" for c in text)
