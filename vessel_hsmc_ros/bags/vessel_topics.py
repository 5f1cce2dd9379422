"""Which topics of a bag are those of a vessel: by names and namespaces, else by types, as a real boat has other names."""

from collections.abc import Mapping
from pathlib import Path

from vessel_hsmc_ros.bags.topic_columns import Series
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages.state_columns import ODOMETRY
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, RELAYED

COMMAND = "cmd_wrench"
NORMALISED = "/normalised_wrench"  # a topic of the type of the wrenches whose numbers are shares of the limits


class VesselTopics:
    """The topics of the vessels in a bag.

    `given`: full names of topics by this package's names, where a person has given them.

    Raises:
        BagError: a topic that was given is not there, or of another type, or cannot be decoded.
    """

    def __init__(self, bag: Path, topics: Mapping[str, Series], given: Mapping[str, str]) -> None:
        self._bag, self._topics, self._given = bag, topics, given
        for own, name in given.items():
            kind = RECORDED_TOPICS[own]
            if name not in self._of_type(kind):
                raise BagError(f"bag {bag} has no {kind} on {name}: it has {', '.join(self._of_type(kind)) or 'none'}")

    def readable(self, name: str) -> bool:
        """Whether a topic, by its full name, has messages that can be decoded."""
        return bool(self._topics.get(name)) and not self._topics[name].undecodable

    @property
    def namespaces(self) -> list[str]:
        """The namespaces that hold a vessel's odometry: `/` or `/alpha/`."""
        odometry = [name for name, series in self._topics.items() if name.endswith("/odom") and series.type == ODOMETRY]
        names = [name.removesuffix("odom") for name in odometry]
        return [name for name in names if not name.endswith(f"/{RELAYED}")]

    def namespace(self, wanted: str | None) -> str:
        """The given namespace if it holds a vessel, or the only one that does, with its slashes.

        Where no topic has the name of the odometry, the only one of its type is that of a vessel in the root namespace. Raises
        BagError if there is no such vessel, or there are several to choose from.
        """
        parts = [part for part in (wanted or "").split("/") if part]
        if "odom" in self._given or not (self.namespaces or parts or self.find("/", "odom") is None):
            return "/" + "".join(f"{part}/" for part in parts)
        found = [name for name in self.namespaces if wanted is None or name.strip("/") == "/".join(parts)]
        if not found:
            where = "" if wanted is None else f" in namespace /{'/'.join(parts)}"
            raise BagError(f"bag {self._bag} has no odometry{where}: {self._alternatives()}")
        if len(found) > 1:
            raise BagError(f"bag {self._bag} has several vessels, in the namespaces {', '.join(found)}: choose one")
        return found[0]

    def find(self, prefix: str, own: str) -> Series | None:
        """The topic of a vessel by this package's name for it; None if the bag has no such messages that can be decoded.

        In a bag of one vessel it is the topic that was given, that of the name in the namespace, else the only one whose name
        ends so, and of odometry and applied wrench the only one of the type. `prefix`: the vessel's namespace, with its
        slashes. `own`: the name without the namespace, such as `odom`.
        """
        exact = self._given.get(own, prefix + own)
        if self.readable(exact):
            return self._topics[exact]
        if len(self.namespaces) > 1 or exact in self._topics:
            return None
        names = self._unnamed(own)
        found = [name for name in names if name.endswith(f"/{own}")]
        by_type = own == "odom" or (own == "applied_wrench" and self.find(prefix, COMMAND) is None)
        found = found or (names if by_type else [])
        return self._topics[found[0]] if len(found) == 1 else None

    def _unnamed(self, own: str) -> list[str]:
        """The topics of the type of one of this package's, without those that are others of its own."""
        others = tuple(f"/{name}" for name, kind in RECORDED_TOPICS.items() if kind == RECORDED_TOPICS[own] and name != own)
        names = self._of_type(RECORDED_TOPICS[own])
        return [n for n in names if not n.endswith((*others, NORMALISED)) and f"/{RELAYED}" not in n]

    def _of_type(self, kind: str) -> list[str]:
        return [name for name, series in self._topics.items() if series.type == kind and self.readable(name)]

    def _alternatives(self) -> str:
        """The topics that may be odometry; without any all topics, with the reason for those that cannot be decoded."""
        reasons = {name: series.undecodable for name, series in self._topics.items()}
        texts = [f"{name} ({reason})" if reason else name for name, reason in reasons.items()]
        names = self._unnamed("odom")
        choice = f"choose one of {', '.join(names)} by --odometry; " if names else ""
        return f"{choice}its topics are {', '.join(texts) or 'none'}"
