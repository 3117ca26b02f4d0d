"""The response of bodies' surfaces to forces: operators.

An operator takes forces on the nodes of a contact surface to displacements of the same nodes. Callers ask for products,
for some of its numbers and for its diagonal, never for an array made in advance: what stands behind it, numbers in
memory or a formula and a Fourier transform, is its own affair. By Maxwell and Betti it is symmetric.

Each body has one of its own, `punch.operator` and `strip.operator` of a case, by the name that it is registered under
here; who asks knows no names. So it is with the integral operators of half-space codes (L. Frérot et al., Tamaas, J.
Open Source Software 5, 2020).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol, Self, runtime_checkable

from fenwear.bodies.condensation import condense_together
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.fine_contact import fine
from fenwear.bodies.half_space import half_space
from fenwear.bodies.response import Request
from fenwear.case import AUTO, CONDENSED, Case
from fenwear.case.dependence import BELOW
from fenwear.common.arrays import Array, Nodes
from fenwear.common.errors import CaseError, InputError


class SurfaceOperator(Protocol):
    """Displacements of q patterns of a contact surface by forces on them, per thickness.

    Displacements are those along a directions of each pattern: along all d axes, or along one alone, the normal of the
    contact, where no other is ever asked for.

    Attributes:
        directions: The directions (q, d, a), unit vectors.
        by_load: Displacement of each pattern by the body's loads (q, d), mm.
        by_temperature: Displacement of each pattern along its one direction from the temperature of this
            rank's own nodes (q, owned), mm/K; None without heat.
        in_memory: Whether its numbers are in memory; else products cost less than all of them.
    """

    @property
    def directions(self) -> Array:
        """Unit vectors (q, d, a)."""

    @property
    def by_load(self) -> Array:
        """Displacement by the loads (q, d), mm."""

    @property
    def by_temperature(self) -> Array | None:
        """Displacement from temperatures (q, owned), mm/K."""

    @property
    def in_memory(self) -> bool:
        """Whether its numbers are in memory."""

    def apply(self, forces: Array) -> Array:
        """Return the displacements (q, a, ...), mm, of forces (q, d, ...), N/mm in the plane."""

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the displacements at some patterns from unit forces along the axes at others (rows, a, columns, d).

        Args:
            rows, columns: Their numbers.
        """

    def diagonal(self) -> Array:
        """Return the displacements at each pattern from unit forces at itself (q, a, d)."""

    def under(self, elastic: ElasticBody) -> Self:
        """Return the operator under other loads, those of `elastic`; collective."""


@runtime_checkable
class Relocatable(Protocol):
    """An operator that answers at any places of its surface: a strip on a grid that passes under the punch."""

    def at(self, x: Array) -> SurfaceOperator:
        """Return the operator with nodes at other places of the body (q, d), mm."""


Make = Callable[[Request], SurfaceOperator]
OPERATORS: dict[str, Make] = {
    "fine": fine,
    "half-space": half_space,
}  # besides the condensed body, which all of them are made of at once


def register_operator(name: str, make: Any = BELOW) -> Any:
    """Make an operator known by its name, as `operator = "name"` of a body in a case made in Python; or a decorator.

    It is called on every rank with what the body is asked for: the body, the shares of its trace nodes in the forces
    (N, q), and one direction for each where no other is asked for.

    Args:
        name: A word, with hyphens; registered again, the new one takes its place.
        make: Returns the operator; collective. Without it, what the decorator stands above.

    Returns:
        The function, or the decorator.

    Raises:
        CaseError: `name` is no word, or that of the condensed body, or `make` cannot be called.
    """
    if make is BELOW:
        return partial(register_operator, name)
    if not (isinstance(name, str) and name.replace("-", "_").isidentifier()) or name in (AUTO, CONDENSED):
        raise CaseError(
            InputError(
                "operator", f"expected a word other than {AUTO!r} and {CONDENSED!r} as a name, got {str(name)!r}"
            )
        )
    if not callable(make):
        raise CaseError(InputError(f"operator {name!r}", "expected a function of a request"))
    OPERATORS[name] = make
    return make


def check_operators(case: Case) -> None:
    """Make sure that the operators of both bodies are known.

    Raises:
        CaseError: one is not.
    """
    known = ", ".join(map(repr, (AUTO, CONDENSED, *sorted(OPERATORS))))
    problems = [
        InputError(
            f"{name}.operator",
            f"no operator {body.operator!r} is registered. Known are {known}. Register your own in Python, "
            "by fenwear.register_operator",
        )
        for name, body in case.bodies.items()
        if body.operator not in (AUTO, CONDENSED, *OPERATORS)
    ]
    if problems:
        raise CaseError(problems)


def operators_for(requests: Sequence[Request], *, keep: bool = False, fresh: bool = False) -> list[SurfaceOperator]:
    """Return the surface operators of bodies, by their settings; collective.

    Args:
        requests: Of the bodies.
        keep: Whether condensed bodies are kept on disk, and taken from there where they are.
        fresh: Condense them whatever is kept.

    Raises:
        CaseError: a body is none for its operator.
        ConvergenceError: a stiffness has no factor.
    """
    decided = {k: _decided(request) for k, request in enumerate(requests) if request.elastic.operator == AUTO}
    wanted = [request.on_mesh() for request in requests if request.elastic.operator == CONDENSED]
    condensed = iter(condense_together(wanted, keep=keep, fresh=fresh) if wanted else [])
    return [
        next(condensed)
        if request.elastic.operator == CONDENSED
        else decided.get(k) or OPERATORS[request.elastic.operator](request)
        for k, request in enumerate(requests)
    ]


def _decided(request: Request) -> SurfaceOperator | None:
    """Return the fine operator of a body on a grid, or None where the body is to be condensed; collective.

    Raises:
        CaseError: it is none, and its grid grows, which no condensed body supports.
    """
    elastic, key = request.elastic, f"{request.elastic.body.name}.operator"
    try:
        decided = fine(request)
    except CaseError as error:
        if elastic.reach is not None or elastic.mortar is None:
            raise
        elastic.operator, elastic.reading = CONDENSED, elastic.mortar()
        elastic.taken = f"{key}: '{CONDENSED}' is used: {error}"
        return None
    elastic.operator = "fine"
    elastic.taken = f"{key}: 'fine' is used: polynomials leave {100 * decided.unresolved:.2g} % of the compliance"
    return decided
