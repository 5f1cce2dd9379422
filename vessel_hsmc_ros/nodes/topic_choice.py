"""Selection of the topics that a recorder subscribes to."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from vessel_hsmc_ros.core.exceptions import ParameterError


@dataclass
class TopicChoice:
    """Selects topics by name, by regular expression, or all except hidden ones (with a token that starts with an underscore).

    Args:
        names: Full names of topics.
        everything: Select every topic.
        regex: Select topics whose full name matches it; empty for none.
        exclude: Regular expression of topics that `everything` and `regex` do not select; empty for none.

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
        """Whether topics are selected whose names are not known in advance."""
        return self.everything or bool(self.regex)

    @property
    def missing(self) -> list[str]:
        """The named topics that are not subscribed to yet."""
        return [name for name in self.names if name not in self._taken]

    def wants(self, name: str) -> bool:
        """Whether a topic is selected, regardless of whether it is subscribed to."""
        if name in self.names:  # a name takes precedence over `exclude` and over being hidden
            return True
        if "/_" in name or (self.exclude and re.fullmatch(self.exclude, name)):
            return False
        return self.everything or bool(self.regex and re.fullmatch(self.regex, name))

    def new(self, present: Iterable[str]) -> list[str]:
        """The selected topics among those present that are not subscribed to yet."""
        return [name for name in present if name not in self._taken and self.wants(name)]

    def take(self, name: str) -> None:
        """Mark a topic as subscribed to: `new` does not return it again."""
        self._taken.add(name)
