"""Control laws, one per file; their registry by name, of this package, of installed packages and of files; and their factory.

An installed package offers a law by an entry point of the group `vessel_hsmc_ros.laws`, which refers to its class. So does
this one with the laws to compare with. A file is read by `scenario.law_file`, when it is named on a command line. Nothing else
adds a law: a scenario or a bag only selects one.
"""

import dataclasses
import logging
import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple, TypeGuard, get_args, get_origin

from vessel_hsmc_ros.control.guided.controller import GuidedController
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import Law, guarded
from vessel_hsmc_ros.control.laws.course import CourseController, PdController
from vessel_hsmc_ros.control.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedController
from vessel_hsmc_ros.control.laws.los_pid import LosPidController
from vessel_hsmc_ros.control.laws.manoeuvre import ManoeuvreController, OpenLoop
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError

GROUP = "vessel_hsmc_ros.laws"  # group of the entry points
RESERVED = (
    "lockstep",
    "recorded",
    "frame_prefix",
    "ride_through",
    "real_time",
    "law",
    "rate_hz",
    "input_timeout",
    "start_enabled",
    "autostart",
    "safety",
    "diagnostics",
    "black_box",
    "vessel",
    "observer",
    "odometry",
)
"""The controller's own parameters, beside which each law's parameters are a group of the law's name."""

NAME = re.compile(r"[a-z][a-z0-9_]*")


class Origin(NamedTuple):
    """Where the code of a law comes from: a file and the SHA-256 of its content, or an installed package without hash."""

    source: str
    sha256: str = ""


class LawKind(NamedTuple):
    """The class of a law, the dataclass that declares its parameters, and its origin; None for a law of this package."""

    controller: type[Law[Any]]
    parameters: type
    origin: Origin | None = None


class Registry(Mapping[str, LawKind]):
    """All control laws by name; those of installed packages are imported at the first use of a name that is not built in."""

    def __init__(self, *built_in: type[Law[Any]]) -> None:
        self._built_in = {law.name: checked(law, None) for law in built_in}
        self._others: dict[str, LawKind] = {}
        self._complete = self._searched = False

    def __getitem__(self, name: str) -> LawKind:
        return self._built_in.get(name) or self.built_in.get(name) or self.others[name]

    def __iter__(self) -> Iterator[str]:
        return iter({**self.built_in, **self.others})

    def __len__(self) -> int:
        return len(self.built_in) + len(self.others)

    @cached_property
    def _entries(self) -> list[EntryPoint]:
        return [*entry_points(group=GROUP)]  # it reads the metadata of every installed package

    @property
    def built_in(self) -> Mapping[str, LawKind]:
        """The laws of this package: those that are given, and those of its own entry points."""
        if not self._complete:
            self._complete = True
            for entry in filter(_is_own, self._entries):
                self._built_in[entry.name] = checked(entry.load(), None)
        return self._built_in

    @property
    def others(self) -> Mapping[str, LawKind]:
        """The laws that are not of this package, in the order of their registration."""
        if not self._searched:
            self._searched = True  # before the imports: a package that uses the registry itself must not start over
            for entry in self._entries:
                if not _is_own(entry):
                    self._take(entry)
        return self._others

    def add(self, *laws: object, origin: Origin) -> None:
        """Register laws; they replace those that have the same origin, as when a file is read again."""
        kept = {name: kind for name, kind in self.others.items() if kind.origin and kind.origin.source != origin.source}
        for law in laws:
            kind = checked(law, origin)
            name = kind.controller.name
            if name in self.built_in:
                raise ParameterError(f"the name {name} is used by a law of vessel_hsmc_ros")
            if name in kept:
                raise ParameterError(f"the name {name} is used by another law of {kept[name].origin.source}")  # type: ignore[union-attr]
            kept[name] = kind
        self._others = kept

    def _take(self, entry: EntryPoint) -> None:
        """Import the law of an entry point; a law that is wrong is left out with a warning, because the user may not need it."""
        package = f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.value
        try:
            law = entry.load()
            if getattr(law, "name", "") != entry.name:
                raise ParameterError(f"{entry.value} has another name, {getattr(law, 'name', None)!r}")
            self.add(law, origin=Origin(f"package {package} ({entry.value})"))
        except Exception as error:
            reason = str(error) if isinstance(error, ParameterError) else f"{type(error).__name__}: {error}"
            logging.getLogger(__name__).warning("warning: law %s of package %s is left out: %s", entry.name, package, reason)


def _is_own(entry: EntryPoint) -> bool:
    """Whether an entry point refers to a law of this package."""
    return entry.module.partition(".")[0] == __name__.partition(".")[0]


def checked(law: object, origin: Origin | None) -> LawKind:
    """Check that an object is a complete law.

    `law`: a subclass of Law that defines `name` and `step`, with a dataclass of declared parameters. `origin`: where it comes
    from; None for a law of this package. Raises ParameterError if it is not; the message names what is missing.
    """
    if not is_law(law):
        raise ParameterError(f"{getattr(law, '__name__', repr(law))} is not a subclass of vessel_hsmc_ros.Law")
    if not NAME.fullmatch(law.name):
        raise ParameterError(
            f'{law.__name__}.name must be lower-case letters, digits and _, such as name = "my_law" (got {law.name!r})'
        )
    if law.name in RESERVED:
        raise ParameterError(f"the name {law.name} is used by the parameter controller.{law.name}")
    if missing := ", ".join(sorted(law.__abstractmethods__)):
        raise ParameterError(f"law {law.name} lacks the method {missing}")
    return LawKind(law, _declared(law), origin)


def is_law(found: object) -> TypeGuard[type[Law[Any]]]:
    """Whether an object is a subclass of Law."""
    return isinstance(found, type) and issubclass(found, Law)


def parameters_of(law: type[Law[Any]]) -> type:
    """The dataclass P of a law that is derived from Law[P]."""
    for cls in law.__mro__:
        for base in vars(cls).get("__orig_bases__", ()):
            arguments = get_args(base)
            if is_law(get_origin(base)) and isinstance(arguments[0], type) and dataclasses.is_dataclass(arguments[0]):
                return arguments[0]
    raise ParameterError(f"law {law.name} declares no parameters: write `class {law.__name__}(Law[P])` with a dataclass P")


def _declared(law: type[Law[Any]]) -> type:
    """The parameters of a law, checked as a declaration."""
    cls = parameters_of(law)
    for field in dataclasses.fields(cls):
        if "group" not in field.metadata and "description" not in field.metadata:
            raise ParameterError(f"{law.name}.{field.name} is not declared: write `{field.name}: float = parameter(...)`")
    try:
        entries, defaults = schema.entries(cls), schema.flatten(cls())
    except (NameError, TypeError) as error:
        raise ParameterError(f"the parameters of law {law.name} cannot be read: {error}") from None
    schema.build(cls, defaults, law.name)
    for name, entry in entries.items():
        # An integer as the default of a float would make an integer parameter of ROS, which then accepts no other number.
        if entry.type in (bool, int, float, str) and type(defaults[name]) is not entry.type:
            raise ParameterError(f"{law.name}.{name} must have a default of its declared type (got {defaults[name]!r})")
    return cls


LAWS = Registry(
    HierarchicalController,
    HierarchicalPrintedController,
    GuidedController,
    CourseController,
    PdController,
    LosPidController,
    ManoeuvreController,
    OpenLoop,
)
"""Every law by its name: all that a law of this room is registered by; its parameters are those that its class declares."""


def make_controller(law: str, period: float, **parameters: object) -> Law[Any]:
    """Make a law from keyword arguments; for notebooks and tests.

    Args:
        law: Name of the law, one of LAWS.
        period: Control period, s.
        parameters: Values by the names that the YAML has below `controller.<law>` and `controller.vessel`; grouped parameters by
            their dotted name, `**{"network.width": 2.0}`. All others keep their defaults.

    Raises:
        ParameterError: the law or a parameter is unknown, a value is out of range, a gain is unstable at this period, or the
            declared vessel has a centre of percussion ahead, to which only the control loop carries ship and reference.
    """
    if law not in LAWS:
        raise ParameterError(f"controller.law must be one of {', '.join(LAWS)} (got {law})")
    # In a scenario the vessel's parameters are a group of the controller, shared by all laws; here one namespace holds both.
    shared = {field.name for field in dataclasses.fields(KnownVessel)}
    vessel = schema.build(KnownVessel, {k: v for k, v in parameters.items() if k in shared}, "controller.vessel")
    if vessel.controlled:
        raise ParameterError(
            f"controller.vessel.sway_yaw_inertia = {vessel.sway_yaw_inertia:g} puts the centre of percussion"
            f" {vessel.controlled:.3g} m ahead, which a law alone does not control:"
            ' simulate a scenario, or give controlled_point="origin"'
        )
    own = {k: v for k, v in parameters.items() if k not in shared}
    return construct(law, schema.build(LAWS[law].parameters, own, f"controller.{law}"), vessel.as_controlled(), period)


def construct(law: str, parameters: object, vessel: KnownVessel, period: float) -> Law[Any]:
    """Construct a law from instances of its parameters.

    Args:
        law: Name of the law, one of LAWS.
        parameters: An instance of the dataclass that the law declares.
        vessel: What the law knows of the ship.
        period: Control period, s.

    Raises:
        ParameterError: the law rejects its parameters, or its code fails.
    """
    with guarded(LAWS[law].controller, ParameterError):
        return LAWS[law].controller(parameters, vessel, period)
