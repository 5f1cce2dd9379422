"""What a controller commands, and why: the codes of ControlState and their texts."""

from enum import IntEnum


class Operation(IntEnum):
    """What a controller does; a person commands it, except for SAFE."""

    STANDBY = 0
    ACTIVE = 1
    SAFE = 2
    STOPPED = 3


class Reason(IntEnum):
    """Why an input is refused, or why the command is not the law's; `text` is a phrase, `level` ok, warn or error."""

    text: str
    level: str

    def __new__(cls, code: int, text: str, level: str) -> "Reason":
        """A reason with its text and level."""
        reason = int.__new__(cls, code)
        reason._value_, reason.text, reason.level = code, text, level
        return reason

    NONE = 0, "the command is the law's", "ok"
    NOT_RECEIVED = 1, "never received", "warn"
    OVERDUE = 2, "not received for its time-out", "error"
    STAMP_OLD = 3, "its stamp is older than its time-out", "error"
    STAMP_FUTURE = 4, "its stamp is ahead of the clock", "error"
    DUPLICATE = 5, "its stamp is that of the last one", "warn"
    OUT_OF_ORDER = 6, "its stamp is before that of the last one", "warn"
    WRONG_FRAME = 7, "it is in another frame", "error"
    NOT_FINITE = 8, "it is not finite", "error"
    UNCERTAIN = 9, "its covariance is above its limit", "error"
    JUMP = 10, "it shows a motion that no ship makes", "warn"
    IN_STANDBY = 20, "not activated", "ok"
    IN_STOP = 21, "stopped until it is rearmed", "warn"
    NOT_READY = 22, "not enough fresh inputs yet", "warn"
    SHUTTING_DOWN = 23, "the node ends", "ok"
    HANDOVER = 24, "the command moves at a bounded rate to that of the law", "ok"
    COMMAND_NOT_FINITE = 30, "the law's command is not finite", "error"
    COMMAND_LIMIT = 31, "the law's command is above its limit", "error"
    COMMAND_RATE = 32, "the law's command changes faster than allowed", "error"
    LAW_UNDEFINED = 33, "the law has no value for its inputs", "error"
    CLOCK_BACKWARD = 40, "the clock was set back", "warn"
    CLOCK_AHEAD = 41, "the clock jumped ahead", "error"
    NOT_MOVING = 50, "the ship is driven and does not move", "error"
    SATURATED = 51, "the command has been at a limit for too long", "error"
    INNOVATION = 52, "measurements have contradicted the estimate for too long", "error"
    VELOCITY = 53, "the measured velocities do not fit the positions", "error"
    FENCE = 54, "the vessel could not stop inside of the fence", "error"
    HEADING = 56, "the measured heading does not fit the motion", "error"
    SECOND_PUBLISHER = 60, "another node commands as well", "error"
    NO_CONSUMER = 61, "nothing subscribes to cmd_wrench", "error"
