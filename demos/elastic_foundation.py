"""A rubber layer on a rigid base as an operator of one's own: an elastic foundation under a steel cylinder.

A thin layer answers to a pressure at the place where it acts alone, by p h / M with its height h and its modulus M of
one-dimensional strain (K. L. Johnson, Contact Mechanics, 1985, section 4.3). Under a cylinder of radius R that is
pressed by the load P the pressure is a parabola, over a half-width a = (3/2 P R h / M)^(1/3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import fenwear
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.response import Request
from fenwear.common.arrays import Array

HEIGHT, MODULUS = 0.5, 200.0  # of the layer, mm and MPa


@dataclass(frozen=True)
class Foundation:
    """What nodes of a surface do that know nothing of each other.

    Attributes:
        directions: Along which displacements are asked for (q, d, a).
        flexibility: Displacement by a unit force at each node (q,), mm per N/mm.
    """

    directions: Array
    flexibility: Array
    by_temperature: None = None  # it does not expand
    in_memory: bool = False  # products are made without a matrix

    @property
    def by_load(self) -> Array:
        """Displacement by the body's own loads (q, d), mm: none."""
        return np.zeros(self.directions.shape[:2])

    def apply(self, forces: Array) -> Array:
        """Return the displacements (q, a, ...) of forces (q, d, ...)."""
        return np.einsum("q,qda,qd...->qa...", self.flexibility, self.directions, forces)

    def diagonal(self) -> Array:
        """Return the displacements at each node from unit forces at itself (q, a, d)."""
        return self.flexibility[:, None, None] * self.directions.transpose(0, 2, 1)

    def entries(self, rows: Any, columns: Any) -> Array:
        """Return the displacements at nodes from unit forces at others (rows, a, columns, d)."""
        every = np.arange(len(self.flexibility))
        same = every[rows][:, None] == every[columns]
        return same[:, None, :, None] * self.diagonal()[rows][:, :, None]

    def under(self, _: ElasticBody) -> Foundation:
        """Return the same under other loads."""
        return self


def rubber(request: Request) -> Foundation:
    """Return the operator of a body from what is asked of it: the nodes that share its surface."""
    areas = request.patterns.T @ (request.elastic.surface.spread @ request.elastic.surface.weights)
    return Foundation(request.along, HEIGHT / MODULUS / areas)


def main(settings: Sequence[str] = ()) -> tuple[fenwear.Tribosystem, Array]:
    """Press the cylinder on the layer; return the system and the pressure, MPa."""
    fenwear.register_operator("rubber", rubber)
    case = fenwear.load_case(
        "fretting-partial-slip",
        ["contact.law='gross-sliding'", "contact.friction=0", "punch.loads.0.force=[0, -2]", "wear.punch.coefficient='0 1/MPa'",
         "wear.strip.coefficient=0", "strip.operator='rubber'",
         "geometry.degree=1", "geometry.parameters.contact_width=2", *settings],
    )  # fmt: skip
    system = fenwear.assemble(case)
    block = next(iter(fenwear.march(system, 1)))
    return system, block.pressure[-1]


if __name__ == "__main__":
    system, pressure = main()
    half_width = (1.5 * 2 * 6 * HEIGHT / MODULUS) ** (1 / 3)
    print(f"largest pressure {pressure.max():.3f} MPa, of a rigid cylinder {MODULUS * half_width**2 / 12 / HEIGHT:.3f}")
    print(f"half-width {system.pair.x[pressure > 0].max():.3f} mm, of a rigid cylinder {half_width:.3f}")
