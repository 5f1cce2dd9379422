"""When commands may be passed to an autopilot, and when a person or the autopilot has taken over.

Commands end at once when the autopilot is disarmed, leaves its mode, reports a failsafe or is not heard, or when a stick of the
radio moves. They do not go on by themselves: only a controller that has been in standby since, and is then enabled by a person,
may command again.
"""

import math
from collections import deque
from collections.abc import Mapping, Sequence

FAILSAFE = (5, 6)  # system states of HEARTBEAT: critical and emergency


class Handover:
    """Whether an autopilot is ready for commands, and whether it has been taken over.

    `mode`: the number of the mode in which it takes commands. `timeout`: time without a heartbeat after which it counts as
    lost, s. `named`: the name of a mode by its number.

    Attributes:
        taken: Why commands have ended and may not go on; empty while they may.
    """

    def __init__(self, mode: int, timeout: float, named: Mapping[int, str]) -> None:
        self._mode, self._timeout, self._named = mode, timeout, named
        self._heard = -math.inf
        self._armed, self._present, self._state = False, -1, 0
        self._standby = True
        self.taken = ""

    def heartbeat(self, now: float, armed: bool, mode: int, state: int) -> None:
        """Take a heartbeat of the autopilot.

        `now`: time of its receipt, s. `armed`: whether the motors are armed.
        """
        self.check(now)  # a gap before it counts, even if nothing has looked at it in between
        self._heard, self._armed, self._present, self._state = now, armed, mode, state
        self.check(now)

    def check(self, now: float) -> None:
        """Take over if the controller commands and the autopilot is not ready at a time, s."""
        if not self._standby and (reason := self.waits(now)):
            self.take_over(reason)

    def take_over(self, reason: str) -> None:
        """End the commands of a controller; in standby it has none."""
        if not self._standby and not self.taken:
            self.taken = reason

    def controller(self, standby: bool, now: float) -> None:
        """Take whether the controller is in standby, which permits that it is enabled again."""
        self._standby = standby
        if standby:
            self.taken = ""
        self.check(now)

    def passes(self, now: float) -> bool:
        """Whether commands may be passed on at a time, s."""
        return not (self._standby or self.taken or self.waits(now))

    def waits(self, now: float) -> str:
        """What the autopilot lacks for commands at a time, s; empty if nothing."""
        if now - self._heard > self._timeout:
            return f"no heartbeat of the autopilot for {self._timeout:g} s" if self._heard > -math.inf else "no autopilot heard"
        if not self._armed:
            return "the autopilot is disarmed"
        if self._present != self._mode:
            return f"mode {self._name(self._present)}, commands need {self._name(self._mode)}"
        return "the autopilot reports a failsafe" if self._state in FAILSAFE else ""

    def _name(self, mode: int) -> str:
        return self._named.get(mode, str(mode))


class Sticks:
    """Whether a pilot moves a stick, by the pulse widths of the radio's channels that an autopilot reports.

    A channel without commands must stay where it was when the controller was enabled. One that commands override must show what
    was sent within MEMORY, once they have been sent for that long; if it does not, the radio has it. `channels`: numbers of the
    channels of the sticks. `threshold`: difference that counts as a movement, µs.
    """

    MEMORY = 1.5

    def __init__(self, channels: Sequence[int], threshold: float) -> None:
        self._channels, self._threshold = channels, threshold
        self._rest: dict[int, int] = {}
        self._sent: deque[tuple[float, Mapping[int, int]]] = deque()
        self._began = math.inf

    def rest(self) -> None:
        """Forget the positions, as when the controller is in standby."""
        self._rest.clear()
        self._sent.clear()
        self._began = math.inf

    def sent(self, now: float, widths: Mapping[int, int]) -> None:
        """Take the pulse widths that were sent for channels at a time, s."""
        self._began = min(self._began, now)
        self._sent.append((now, widths))
        self._forget(now)

    def _forget(self, now: float) -> None:
        while self._sent and self._sent[0][0] < now - self.MEMORY:
            self._sent.popleft()
        if not self._sent:
            self._began = math.inf

    def moved(self, now: float, widths: Sequence[int]) -> str:
        """Which stick has moved; empty if none has.

        `now`: time of the report, s. `widths`: pulse widths of the channels from 1 on, µs; 0 and 65535 are channels without a
        signal.
        """
        self._forget(now)
        for channel in self._channels:
            width = widths[channel - 1] if channel <= len(widths) else 0
            if width in (0, 65535):
                continue
            known = [sent[channel] for _, sent in self._sent if channel in sent]
            if known and now - self._began < self.MEMORY:
                continue
            known = known or [self._rest.setdefault(channel, width)]
            if not min(known) - self._threshold <= width <= max(known) + self._threshold:
                return f"channel {channel} of the radio is at {width} µs"
        return ""
