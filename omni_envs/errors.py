"""Errors of the package: one base class, and messages that name what is wrong and what is valid."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path


class OmniEnvsError(Exception):
    """Base class of every error that omni_envs raises on purpose."""


class UnknownNameError(OmniEnvsError, ValueError):
    """A name that is not registered.

    Args:
        kind: What was looked up, e.g. ``"robot"``.
        name: The name that was given.
        valid: The names that exist.
    """

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        self.kind, self.name, self.valid = kind, name, tuple(sorted(valid))
        close = get_close_matches(str(name), self.valid, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        super().__init__(
            f"Unknown {kind} {name!r}.{hint} Valid: {', '.join(self.valid) or 'none'}."
        )


class InvalidOptionError(OmniEnvsError, ValueError):
    """An option with a value that is not allowed."""


class InvalidValueError(InvalidOptionError):
    """An option with a value that is not allowed, in parts, for whoever knows where it was written.

    Args:
        option: The option.
        expected: What its value must be.
        found: What it is.
    """

    def __init__(self, option: str, expected: str, found: object) -> None:
        self.option, self.expected, self.found = option, expected, f"{found!r:.80}"
        super().__init__(f"{option}: expected {expected}; got {self.found}.")


class InvalidDataError(OmniEnvsError, ValueError):
    """In-memory data that breaks its contract.

    Args:
        owner: The object, e.g. ``"Demonstration 'sub3'"``.
        field: The offending field.
        expected: What the field must be.
        found: What it is.
    """

    def __init__(self, owner: str, field: str, expected: str, found: str) -> None:
        self.owner, self.field = owner, field
        super().__init__(f"{owner}: {field} must be {expected}; got {found}.")


class FileFormatError(OmniEnvsError, ValueError):
    """A file that cannot be read as what it should be.

    Args:
        path: The file.
        field: The part of the file that is wrong.
        expected: What was expected there.
        found: What was found.
    """

    def __init__(self, path: str | Path, field: str, expected: str, found: str) -> None:
        self.path, self.field = Path(path), field
        super().__init__(f"{path}: {field}: expected {expected}; found {found}.")


class RenderingError(OmniEnvsError, RuntimeError):
    """No picture can be made on this machine.

    Args:
        reason: What the graphics library said.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"Offscreen rendering does not work here: {reason} Without a display MuJoCo needs EGL "
            "or OSMesa (Debian: apt-get install libegl1) and MUJOCO_GL=egl or osmesa before it is "
            "imported; importing omni_envs first sets it."
        )


class MissingDependencyError(OmniEnvsError, ImportError):
    """An optional package that is not installed.

    Args:
        package: The package that could not be imported.
        extra: The extra of omni_envs that brings it.
        purpose: What it is needed for.
    """

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        super().__init__(
            f"{purpose} needs {package}, which is not installed: pip install 'omni-envs[{extra}]'"
        )
