"""The variants of a sweep, in the order in which they share most."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, product
from typing import Literal

import numpy as np

import fenwear
from fenwear.assembly import Preparation, set_up_by
from fenwear.case import Case, changed_case
from fenwear.errors import CaseError, InputError
from fenwear.sweeps.axes import OPTION, Axis, Value, check_keys, settings, value_at

Of = Literal["steady", "optimum", "run"]
KINDS: tuple[Of, ...] = ("steady", "optimum", "run")
MOST = 10_000  # variants
MOST_TOLD = 10  # problems


@dataclass(frozen=True)
class Variant:
    """One variant of a sweep.

    Attributes:
        place: Its indices in the dimensions of the sweep.
        settings: What it changes, as `key.path=value`.
        case: The case; None where the values do not go together.
        error: Why they do not.
        name: Of its kept results: the same for the same case, whatever it is swept with.
    """

    place: tuple[int, ...]
    settings: tuple[str, ...]
    case: Case | None
    error: CaseError | None = None
    name: str = ""


@dataclass(frozen=True)
class Plan:
    """A sweep.

    Attributes:
        of: What is computed of each variant.
        axes: Keys and their values.
        zipped: Whether all axes go together, one variant for each place in them, or each value with each.
        coordinates: Values of each axis as the cases have them, and their unit.
        variants: All of them, the last axis fastest.
    """

    of: Of
    axes: tuple[Axis, ...]
    zipped: bool
    coordinates: tuple[tuple[tuple[Value, ...], str], ...]
    variants: tuple[Variant, ...]

    @property
    def dimensions(self) -> dict[str, int]:
        """Names and sizes of the dimensions of the sweep."""
        if self.zipped:
            return {"variant": len(self.axes[0].values)}
        return {axis.key: len(axis.values) for axis in self.axes}


def make_plan(case: Case, axes: Sequence[Axis], of: str, *, zipped: bool = False) -> Plan:
    """Return the variants of a case.

    Args:
        case: The case that is varied.
        axes: Keys and their values.
        of: What is computed of each variant.
        zipped: Whether the first values go together, the second ones, and so on.

    Raises:
        CaseError: no variant can have a value, a key is given twice, there are too many variants, or axes
            that go together have not equally many values.
    """
    check_keys(axes)
    kind = next((one for one in KINDS if one == of), None)
    if kind is None:
        raise CaseError(InputError("--of", f"expected one of {', '.join(KINDS)}, got {of!r}"))
    lengths = [len(axis.values) for axis in axes]
    if zipped and len(set(lengths)) > 1:
        each = ", ".join(f"{axis.key} {len(axis.values)}" for axis in axes)
        raise CaseError(InputError("--zip", f"expected as many values of each key, got {each}"))
    count = lengths[0] if zipped else math.prod(lengths)
    if count > MOST:
        shape = f"{count:,}" if zipped or len(lengths) == 1 else f"{' x '.join(map(str, lengths))} = {count:,}"
        raise CaseError(InputError(OPTION, f"expected at most {MOST:,} variants, got {shape}"))
    places = [(k,) * len(axes) for k in range(count)] if zipped else list(product(*map(range, lengths)))
    files: dict[str, bytes] = {}
    variants = [_variant(case, axes, place, kind, zipped=zipped, files=files) for place in places]
    _check_values(axes, places, variants, zipped=zipped)
    coordinates = tuple(_coordinate(axis, k, places, variants) for k, axis in enumerate(axes))
    for axis, (values, _) in zip(axes, coordinates, strict=True):
        twice = [] if zipped else [value for at, value in enumerate(values) if value in values[:at]]
        if twice:
            raise CaseError(InputError(f"{OPTION} {axis.key}", f"has the value {twice[0]} twice"))
    return Plan(kind, tuple(axes), zipped, coordinates, tuple(variants))


def _variant(
    case: Case, axes: Sequence[Axis], place: tuple[int, ...], of: Of, *, zipped: bool, files: dict[str, bytes]
) -> Variant:
    given = {axis.key: (axis, axis.values[at]) for axis, at in zip(axes, place, strict=True)}
    own = place[:1] if zipped else place
    changes = tuple(axis.setting(value) for axis, value in given.values())
    try:
        changed = changed_case(case, *settings(case, given))
    except CaseError as error:
        return Variant(own, changes, None, error)
    return Variant(own, changes, changed, name=_name(changed, of, files))


def _name(case: Case, of: Of, files: dict[str, bytes]) -> str:
    """Return a name that is the same for the same results; what a file of the geometry holds counts."""
    mesh = case.resolved()["geometry"]["file"]
    if mesh not in files:
        try:
            with open(mesh, "rb") as file:
                files[mesh] = hashlib.file_digest(file, "sha256").digest()
        except OSError:  # one of those that come with the package
            files[mesh] = b""
    text = f"{fenwear.__version__}\n{of}\n{case.to_toml()}"
    return hashlib.sha256(text.encode() + files[mesh]).hexdigest()[:20]


def _check_values(
    axes: Sequence[Axis], places: Sequence[tuple[int, ...]], variants: Sequence[Variant], *, zipped: bool
) -> None:
    """Raise for every value that no variant can have; values that do not go together fail alone."""
    problems: dict[InputError, None] = {}
    for k, axis in enumerate(axes):
        for at in range(len(axis.values)):
            own = [variant for place, variant in zip(places, variants, strict=True) if place[k] == at]
            if own[0].error is not None and all(variant.case is None for variant in own):
                row = f"variant {at + 1}: " if zipped else ""
                problems |= {InputError(p.key, f"{row}{p.message}"): None for p in own[0].error.problems}
    if problems:
        raise CaseError(list(problems)[:MOST_TOLD])


def _coordinate(
    axis: Axis, k: int, places: Sequence[tuple[int, ...]], variants: Sequence[Variant]
) -> tuple[tuple[Value, ...], str]:
    """Return the values of an axis as the cases have them: numbers in one unit, else texts."""
    found: dict[int, tuple[Value, str]] = {}
    for place, variant in zip(places, variants, strict=True):
        if variant.case is not None and place[k] not in found:
            found[place[k]] = value_at(variant.case, axis.key)
    values, units = zip(*(found[at] for at in range(len(axis.values))), strict=True)
    if len(set(units)) == 1 and all(isinstance(value, int | float) for value in values):
        return values, units[0]
    return tuple(map(str, axis.values)), ""


def preparation_for(case: Case, of: Of) -> Preparation:
    """Return how the heat of a variant is prepared."""
    if of == "optimum":
        return "none"
    return "reduced" if of == "steady" or case.run.integration == "jump" else "as set"


def _sharing(variant: Variant, of: Of) -> tuple[str, str]:
    """Return what two variants share: the bodies, and with them the steps of their heat."""
    case = variant.case
    assert case is not None
    heat = (
        None
        if case.heat is None
        else (case.motion, case.heat, case.punch.boundary_of_heat, case.strip.boundary_of_heat)
    )
    return repr((preparation_for(case, of), *set_up_by(case))), repr(heat)


def in_pieces(left: Sequence[Variant], of: Of, workers: int) -> list[list[Variant]]:
    """Return variants in pieces: those in one share their set-up. Few pieces are cut, so that no worker is idle."""
    keys = {variant.place: _sharing(variant, of) for variant in left}
    ordered = sorted(left, key=lambda variant: keys[variant.place])  # stable: else in the order of the sweep
    pieces = [list(group) for _, group in groupby(ordered, key=lambda variant: keys[variant.place][0])]
    while workers > 1 and len(pieces) < 4 * workers:
        pieces.sort(key=len)
        longest = pieces.pop()
        if len(longest) < 2:
            return [*pieces, longest]
        half = _cut([keys[variant.place][1] for variant in longest])
        pieces += [longest[:half], longest[half:]]
    return sorted(pieces, key=lambda piece: keys[piece[0].place])


def _cut(keys: Sequence[str]) -> int:
    """Return where to cut a piece: near its middle, and if it can be where the heat's steps change."""
    changes = [k for k in range(1, len(keys)) if keys[k] != keys[k - 1]]
    middle = len(keys) // 2
    near = [k for k in changes if abs(k - middle) <= len(keys) // 4]
    return min(near, key=lambda k: abs(k - middle)) if near else int(np.clip(middle, 1, len(keys) - 1))
