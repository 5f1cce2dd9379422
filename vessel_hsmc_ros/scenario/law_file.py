"""Reads control laws from a Python file, which only a command line or a Python program can name."""

import hashlib
import sys
import traceback
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import ModuleType

from vessel_hsmc_ros.control.interface.law import Law
from vessel_hsmc_ros.control.laws import LAWS, Origin, is_law
from vessel_hsmc_ros.core.exceptions import ParameterError

OPTION = "--law-file"


def load_law_file(path: Path | str) -> tuple[str, ...]:
    """Execute a Python file and register the control laws that it defines, under their names.

    A file that is read again replaces its earlier laws.

    Args:
        path: The file. What else it needs must be installed: its folder is not searched for imports.

    Raises:
        ParameterError: the file cannot be read or executed, has no law, or one that is not complete, or whose name is used.
    """
    path = Path(path).absolute()
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ParameterError(f"law file {path} cannot be read: {error.strerror}") from None
    laws = _laws(_executed(path, content), path)
    try:
        LAWS.add(*laws, origin=Origin(str(path), hashlib.sha256(content).hexdigest()))
    except ParameterError as error:
        raise ParameterError(f"law file {path}: {error}") from None
    return tuple(law.name for law in laws)


def law_file_options() -> list[str]:
    """The command-line options by which the controller's process reads the same files as this one."""
    return [part for file in loaded_law_files() for part in (OPTION, str(file))]


def loaded_law_files() -> list[Path]:
    """The files of the laws that were read from files: another process of the same run reads them too."""
    origins = [kind.origin for kind in LAWS.others.values() if kind.origin and kind.origin.sha256]
    return list(dict.fromkeys(Path(origin.source) for origin in origins))


def load_named_files(arguments: Iterable[str]) -> list[str]:
    """Load the files of every `--law-file FILE` among the arguments of a node, and return the other arguments."""
    remaining, others = iter(arguments), []
    for argument in remaining:
        option, _, file = argument.partition("=")
        if option != OPTION:
            others.append(argument)
            continue
        file = file or next(remaining, "")
        if not file:
            raise ParameterError(f"{OPTION} must be a Python file (got nothing)")
        load_law_file(file)
    return others


def is_present(source: str) -> bool:
    """Whether the code that a bag's note `law_source` describes is registered now: the same content, wherever the file lies."""
    origins = [kind.origin for kind in LAWS.others.values() if kind.origin]
    return any((origin.sha256 or origin.source) in source for origin in origins)


def law_provenance(law: str) -> dict[str, str]:
    """Origin of the code of a law, for the records of a run; empty for a law of this package."""
    origin = LAWS[law].origin
    return {} if origin is None else {"law_source": origin.source, "law_sha256": origin.sha256}


def law_source(law: str) -> str:
    """Origin of the code of a law in one line, for the notes of a bag; empty for a law of this package."""
    return " ".join(law_provenance(law).values())


def _executed(path: Path, content: bytes) -> ModuleType:
    """The module that a file defines; not by the import system, which would write a cache beside the file."""
    # The full path keeps apart two files of the same name; dataclasses find their module by its name.
    module = ModuleType(f"law_file_{hashlib.sha256(str(path).encode()).hexdigest()[:12]}")
    module.__file__ = str(path)
    previous = sys.modules.get(module.__name__)
    sys.modules[module.__name__] = module
    try:
        exec(compile(content, str(path), "exec", dont_inherit=True), module.__dict__)  # noqa: S102 - named by the user
    except (Exception, SystemExit) as error:
        if previous:  # the laws of an earlier, intact version stay usable
            sys.modules[module.__name__] = previous
        text = " ".join((error.msg if isinstance(error, SyntaxError) else str(error)).split())
        raise ParameterError(f"law file {_place(path, error)}: {type(error).__name__}: {text}") from None
    return module


def _place(path: Path, error: BaseException) -> str:
    """The file and the line of it that an error comes from."""
    if isinstance(error, SyntaxError) and error.lineno is not None and error.filename == str(path):
        return f"{path}:{error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return f"{path}:{lines[-1]}" if lines else str(path)


def _laws(module: ModuleType, path: Path) -> Sequence[type[Law[object]]]:
    """The laws among the classes that a module defines; classes without a name are bases of others."""
    classes = [found for found in vars(module).values() if isinstance(found, type) and found.__module__ == module.__name__]
    laws = [cls for cls in dict.fromkeys(classes) if is_law(cls)]
    if named := [law for law in laws if law.name]:
        return named
    if laws:
        raise ParameterError(f'law file {path}: class {laws[0].__name__} has no name: it needs a line such as name = "my_law"')
    if wrong := [cls.__name__ for cls in classes if hasattr(cls, "step")]:
        raise ParameterError(f"law file {path}: class {wrong[0]} is not a subclass of vessel_hsmc_ros.Law")
    raise ParameterError(f"law file {path} has no law: it needs a subclass of vessel_hsmc_ros.Law")
