"""The exceptions for invalid input. A motion that diverges is no error: it is a result with a label of its own."""

from __future__ import annotations

import difflib
import numbers
import re
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

T = TypeVar("T")
LARGEST_INTEGER = 2**53  # largest integer that is accepted by default; up to it every integer is exactly a float
_LIKE = 0.55  # least likeness of words, one being a slip for the other
_MAX_SHOWN = 200  # most characters of a value that a message shows in full; else its beginning and end are shown


class InputError(ValueError):
    """A value given by the user that breaks a rule.

    Parameters
    ----------
    field : str
        Name of the value: a parameter, an option, a key of a study file.
    rule : str
        The rule as the predicate of a sentence whose subject is the field, e.g. "must be greater than 0".
    value : object
        The value.
    advice : str
        What to do, or why the rule exists, in complete sentences; may be empty.

    Notes
    -----
    It is raised before any work, at the public boundary. It is a `ValueError`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> try:
    ...     gc.MeshModel.of(zeta=-1)
    ... except gc.InputError as error:
    ...     print(error.field, "|", error.rule, "|", error.value)
    zeta | must not be negative | -1.0
    """

    def __init__(self, field: str, rule: str, value: object, advice: str = "") -> None:
        self.field, self.rule, self.value, self.advice = field, rule, value, advice
        text = f"{field} {rule}; got {_shown(value)}."
        super().__init__(f"{text} {advice}".rstrip())

    def __reduce__(self):
        return type(self), (self.field, self.rule, self.value, self.advice)


def gather(calls: Iterable[Callable[[], T]]) -> list[T]:
    """What these calls return; raises one `InputError` for all that raise one, so that none hides another."""
    found, refused = [], []
    for call in calls:
        try:
            found.append(call())
        except InputError as error:
            refused.append(error)
    if refused:
        raise all_of(refused)
    return found


def all_of(refused: Sequence[InputError]) -> InputError:
    """The first of some errors, whose advice ends with the others; advice that is the same is said once."""
    first, *others = refused
    also = [f"Also: {str(e).removesuffix(first.advice).rstrip()}" for e in others]
    if not also:
        return first
    return InputError(first.field, first.rule, first.value, " ".join([first.advice, *also]).lstrip())


class DesignWarning(UserWarning):
    """An unusual value of a gear design or a gear pair, or something that its transmission error leaves out."""


class ChangedFileError(InputError):
    """A file from which gears were made that is missing or has other content now; its value is the path."""


def _shown(value: object) -> str:
    """The text of a value in a message."""
    try:
        text = repr(value.item()) if hasattr(value, "item") and getattr(value, "size", 1) == 1 else repr(value)
    except ValueError:  # Python refuses to convert an integer of more than 4300 digits
        return "a number too long to show"
    if len(text) <= _MAX_SHOWN:
        return text
    return f"{text[: _MAX_SHOWN // 2]} … {text[-_MAX_SHOWN // 4 :]} ({len(text):,} characters)"


def whole_number(field: str, value: object, least: int, most: int = LARGEST_INTEGER) -> int:
    """The value as an int; raises `InputError` unless it is a whole number from ``least`` to ``most``."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < least:
        raise InputError(field, f"must be a whole number of at least {least}", value)
    if int(value) > most:
        raise InputError(field, f"must be at most {most:,}", value)
    return int(value)


def missing_package(field: str, package: str, extra: str) -> InputError:
    """The error for a package of an extra that is not installed, with the command that installs it in any shell."""
    advice = f'Run: pip install "gearchaos[{extra}]".'
    return InputError(field, f"needs the package {package}", "no such package", advice)


# names that are asked for and that nothing has, as regular expressions, and which part of the manual answers
_ANSWERED = {
    r"friction|\boil|lubri|viscosity|temperature": "The model leaves out friction between the teeth, oil and "
    "temperature: see 'What the model leaves out' in the manual, docs/explanation/left_out.md.",
    r"^(model\.)?stiffness": "The mesh stiffness is a table [model.stiffness] with kind = 'two-level', 'harmonics', "
    "'steps' or 'tooth pairs': docs/model.md, Parameters. Any curve of given gears is a table of numbers: "
    "docs/howto/own_stiffness.md.",
    "^helix_angle$": "It is an input of a drawing, a [design]. A mesh has one with design = 'pair.toml', planets have "
    "one for all in [train.planets]; without, base radii, backlash and stiffness are those of the transverse plane.",
    r"bevel|(?<![a-z])cone|worm|hypoid|spiral|shaft_angle": "Gears on parallel axes are computed. A bevel or worm "
    "gear is a mesh of a [train] with its base radii, stiffness and backlash in the plane of its forces, and no axial "
    "motion.",
    "tanh|arctan|smooth": "The backlash is piecewise linear and is not smoothed: docs/method.md.",
}


def unknown_name(field: str, name: str, known: Iterable[str]) -> InputError:
    """The error for an unknown name, which lists the known names and suggests the most similar one, or says which part
    of the manual answers.

    Each word of the name must be like one of that: a helix angle is no slip for a pressure angle.
    """
    known = sorted(known)
    alike = difflib.get_close_matches(name, known, n=len(known) or 1, cutoff=0.5)
    near = [each for each in known if each.lower() == name.lower()] or [each for each in alike if all(
        difflib.get_close_matches(word, _words(each), cutoff=_LIKE) for word in _words(name))]
    advice = next((answer for words, answer in _ANSWERED.items() if re.search(words, name.lower())),
                  f"Did you mean {near[0]!r}?" if near else "")
    return InputError(field, f"must be one of {', '.join(known)}", name, advice)


def _words(name: str) -> list[str]:
    return re.split("[_.]", name)
