"""Errors: one class per thing the user can do about it; every message says what, where, what is allowed, what to do."""

import difflib
import functools
import inspect
import typing
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


class OptsatError(Exception):
    """Base of every error that optsat raises on purpose."""


class InputError(OptsatError, ValueError):
    """An argument is wrong; the message names it."""


class UnknownOptionError(OptsatError, TypeError):
    """An option has a name that the call does not know; the message offers the nearest one."""


class InfeasibleBoxError(InputError):
    """A component box does not touch the unit sphere, so it cannot hold a direction."""


class RecordError(OptsatError, ValueError):
    """A measurement log is wrong at a file, line and column."""

    def __init__(self, message: str, *, file: str, line: int | None = None, column: str | None = None) -> None:
        where = file + (f", line {line}" if line is not None else "") + (f", column {column}" if column else "")
        super().__init__(f"{where}: {message}")
        self.file, self.line, self.column = file, line, column


class UnsupportedFormError(OptsatError, TypeError):
    """A solver was asked for a form that it cannot solve."""


class NotProvenError(OptsatError):
    """A solution does not carry the proof that was required; the answer is kept in `.solution`."""

    def __init__(self, message: str, solution: object) -> None:
        super().__init__(message)
        self.solution = solution


class CertificateFormatError(OptsatError, ValueError):
    """A certificate file cannot be read as one of the known formats."""


class MissingExtraError(OptsatError, ImportError):
    """An optional dependency is absent; the message names the extra that brings it."""


def nearest_name(name: str, known: list[str]) -> str:
    """Return ' Did you mean `x`?' for the nearest known name, or the list of known names."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return f" Did you mean `{near[0]}`?" if near else f" Known: {', '.join(known)}."


def explain_unknown_options(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a public function so that a misspelt keyword names the nearest option instead of a bare TypeError."""
    checked = _checked(function, function.__name__, list(_written_out(function).parameters))
    setattr(checked, "__signature__", _written_out(function))  # noqa: B010
    return checked


class _Optional:
    """Default of an option that a table of options holds: shown as stub files show it."""

    def __repr__(self) -> str:
        return "..."


def _written_out(function: Callable[..., object]) -> inspect.Signature:
    """Return the signature with every option of an unpacked table by its own name, as help shows it."""
    signature = inspect.signature(function)
    parameters = []
    for each in signature.parameters.values():
        table = typing.get_args(each.annotation)
        if each.kind is not inspect.Parameter.VAR_KEYWORD or not table:
            parameters.append(each)
            continue
        parameters += [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=_Optional())
            for name in typing.get_type_hints(table[0])
        ]
    return signature.replace(parameters=parameters)


def explain_unknown_fields(data: type[T]) -> type[T]:
    """Decorate a public dataclass likewise."""
    known = list(inspect.signature(data).parameters)
    setattr(data, "__init__", _checked(data.__init__, data.__name__, known))  # noqa: B010
    return data


def _checked(function: Callable[P, R], called: str, known: list[str]) -> Callable[P, R]:
    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in kwargs:
            if name not in known:
                raise UnknownOptionError(f"{called} has no option `{name}`.{nearest_name(name, known)}")
        return function(*args, **kwargs)

    return checked
