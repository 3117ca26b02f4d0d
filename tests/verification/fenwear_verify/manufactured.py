"""What manufactured solutions share: meshes of a unit square, errors against known fields, body forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import basix.ufl
import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
import ufl
from dolfinx import fem

from fenwear.algebra.assembled import assembled_vector, compiled
from fenwear.bodies.elasticity import ElasticBody
from fenwear.common.arrays import Array
from fenwear_verify.suite import Line, Plot

DEGREES = (1, 2, 3, 4)
Exact = Callable[[Array, Array], Array]  # of x and z (points,), a field (points,) or (components, points)


def unit_square(elements: int) -> dict[str, float]:
    """Return the sizes of two blocks whose strip is -1/2 < x < 1/2, -1 < z < 0 in `elements` squared squares."""
    return {"across": elements, "strip_layers": elements, "punch_layers": 1}


def _richer(function: fem.Function, exact: Exact) -> fem.Function:
    """Return the known field on elements so rich that its own error does not show; collective."""
    space = function.function_space
    element = space.ufl_element()
    mesh = space.mesh
    rich = basix.ufl.element("Lagrange", mesh.basix_cell(), element.degree + 3, shape=element.reference_value_shape)
    field = fem.Function(fem.functionspace(mesh, rich))
    field.interpolate(lambda x: exact(x[0], x[1]))
    return field


def errors(function: fem.Function, exact: Exact) -> tuple[float, float]:
    """Return the L2 norms of the error of a field and of its gradient; collective."""
    error = function - _richer(function, exact)
    mesh = function.function_space.mesh
    forms = (compiled(ufl.inner(e, e) * ufl.dx(domain=mesh)) for e in (error, ufl.grad(error)))
    squares = [mesh.comm.allreduce(fem.assemble_scalar(form)) for form in forms]
    return math.sqrt(squares[0]), math.sqrt(squares[1])


def displacement(body: ElasticBody, force: Array) -> fem.Function:
    """Return the displacement of a supported body under nodal forces; collective."""
    force[body.supported] = 0.0
    u = fem.Function(body.space)
    u.x.array[: len(force)] = body.solve(force)
    u.x.scatter_forward()
    return u


def body_force(body: ElasticBody, density: Exact) -> Array:
    """Return the nodal forces of a force density per volume; collective."""
    field = _richer(fem.Function(body.space), density)
    return assembled_vector(ufl.inner(field, ufl.TestFunction(body.space)) * ufl.dx)


def convergence_plot(
    title: str, sizes: Sequence[Array], found: Sequence[Array], names: Sequence[str], orders: Sequence[float]
) -> Plot:
    """Return the plot of errors over element sizes with the triangles of the theory's orders."""
    lines = [Line(name, h, e) for name, h, e in zip(names, sizes, found, strict=True)]
    return Plot(title, "element size h (mm)", "relative error", lines, ("log", "log"), tuple(orders))


def stacked(*components: Any) -> Array:
    """Return the components of a vector field as one array (components, points)."""
    return np.stack([np.asarray(c, dtype=float) for c in components])
