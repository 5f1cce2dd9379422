"""The parameters of the plant's clock, in lockstep."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter


@dataclass(frozen=True)
class ClockParameters:
    """Whose /clock the plant keeps to in lockstep; without effect in real time."""

    source: str = parameter("own", "Publish /clock, or follow that of another plant.", choices=("own", "follow"))
    # ROS has no empty list of strings in its parameters files.
    followers: tuple[str, ...] = parameter(
        ("",),
        "Namespaces of the plants that follow this one's /clock; an empty name for none. A step begins when all have finished"
        " the one before.",
    )

    @property
    def others(self) -> tuple[str, ...]:
        """The namespaces of the followers, without slashes at their ends."""
        return tuple(name.strip("/") for name in self.followers if name)
