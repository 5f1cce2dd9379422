"""Which topics a recorder takes."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from vessel_hsmc_ros.core.exceptions import ParameterError


@dataclass
class TopicChoice:
    """Topics by name, by regular expression, or all but hidden ones: those with a token that starts with an underscore.

    Args:
        names: Full names.
        everything: Take every topic.
        regex: Take topics that it matches from beginning to end; empty for none.
        exclude: Leave these out of what `everything` and `regex` take; empty for none.

    Raises:
        ParameterError: `regex` or `exclude` is not a valid regular expression.
    """

    names: Sequence[str]
    everything: bool = False
    regex: str = ""
    exclude: str = ""
    _taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        for name in ("regex", "exclude"):
            try:
                re.compile(getattr(self, name))
            except re.error as error:
                text = getattr(self, name)
                raise ParameterError(
                    f"recorder.{name} = {text} is not allowed: it takes a regular expression ({error})"
                ) from None

    @property
    def open_ended(self) -> bool:
        """Whether topics may be wanted whose names are not known."""
        return self.everything or bool(self.regex)

    @property
    def missing(self) -> list[str]:
        """The named topics that have not been taken yet."""
        return [name for name in self.names if name not in self._taken]

    def wants(self, name: str) -> bool:
        """Whether a topic is wanted, taken or not."""
        if name in self.names:
            return True
        if "/_" in name or (self.exclude and re.fullmatch(self.exclude, name)):
            return False
        return self.everything or bool(self.regex and re.fullmatch(self.regex, name))

    def new(self, present: Iterable[str]) -> list[str]:
        """Of the topics that are there, those that are wanted and have not been taken yet."""
        return [name for name in present if name not in self._taken and self.wants(name)]

    def take(self, name: str) -> None:
        """From now on this topic is not new."""
        self._taken.add(name)
