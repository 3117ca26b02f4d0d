"""A wrong sign, a lost factor: the verification cases find them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import csr_array

from fenwear import Tribosystem
from fenwear.bodies import elastic_material
from fenwear.bodies.elastic_material import Isotropic
from fenwear.common.arrays import Array
from fenwear.contact import CondensedContact, SlidingContact
from fenwear.heat.conduction import HeatBody
from fenwear.heat.heat_exchange import TERMS, HeatExchange
from fenwear.laws.local_laws import Wear
from fenwear.surfaces import ContactPair, Interface, RigidEquilibrium
from fenwear.surfaces.motion import Motion
from fenwear.system import both_bodies, placing
from fenwear_verify import flash as flash_cases
from fenwear_verify import registered, run_cases
from fenwear_verify import wear as wear_cases
from fenwear_verify.bodies import builtin, rigid_punch
from fenwear_verify.conduction import conducting_square
from fenwear_verify.contact import half_planes
from fenwear_verify.thermal import conductor

Patch = pytest.MonkeyPatch
CACHES = (builtin, rigid_punch, half_planes, conducting_square, conductor)


def interpolation(nodes: Array, degree: int, x: Array) -> Array:
    """Return the matrix of piecewise Lagrange interpolation from `nodes` to `x`.

    Args:
        nodes: Ascending abscissae; every facet has degree + 1 of them, its ends shared.
        x: Abscissae inside the nodes' range.
    """
    ends = nodes[::degree]
    facet = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(ends) - 2)
    columns = facet[:, None] * degree + np.arange(degree + 1)
    matrix = np.zeros((len(x), len(nodes)))
    np.put_along_axis(matrix, columns, lagrange(nodes[columns], x), axis=1)
    return matrix


def lagrange(nodes: Array, x: Array) -> Array:
    """Return the Lagrange polynomials of `nodes` (..., k) at `x` (...), shape (..., k)."""
    difference = x[..., None, None] - nodes[..., None, :]
    spacing = nodes[..., :, None] - nodes[..., None, :]
    same = np.eye(nodes.shape[-1], dtype=bool)
    return (np.where(same, 1.0, difference) / np.where(same, 1.0, spacing)).prod(axis=-1)


@pytest.fixture(autouse=True)
def _nothing_kept() -> Iterator[None]:
    """Keep no system from before the change, and none with it."""
    for cache in CACHES:
        cache.cache_clear()
    yield
    for cache in CACHES:
        cache.cache_clear()


def opposite_friction(patch: Patch) -> None:
    """Tangential compliance with the other sign."""
    right = Interface.compliance
    patch.setattr(Interface, "compliance", lambda self, slip, scale=1.0: right(self, -slip, scale))


def kernels_the_other_way(patch: Patch) -> None:
    """Heat of a grid carried against its material."""
    right = flash_cases.cell_integrals

    def turned(shape: Any, sides: Any, decay: Any, drift: tuple[float, float]) -> Any:
        return right(shape, sides, decay, (-drift[0], -drift[1]))

    patch.setattr(flash_cases, "cell_integrals", turned)


def opposite_moment(patch: Patch) -> None:
    """Moment of the friction with the other sign."""
    right = RigidEquilibrium.equilibrium
    patch.setattr(RigidEquilibrium, "equilibrium", lambda self, slip: right(self, -slip))


def punch_without_poisson(patch: Patch) -> None:
    """The punch in plane stress, so that E* lacks its 1 - nu²."""
    right = both_bodies.isotropic

    def isotropic(body: Any, regions: Any, materials: Any, kind: Any) -> Isotropic:
        return right(body, regions, materials, "stress" if body.name == "punch" else kind)

    patch.setattr(both_bodies, "isotropic", isotropic)


def lame_of_the_other_plane(patch: Patch) -> None:
    """Plane stress for plane strain, and the other way round."""
    right = elastic_material.lame
    other = {"stress": "strain", "strain": "stress"}
    patch.setattr(elastic_material, "lame", lambda young, poisson, plane: right(young, poisson, other[plane]))


def _pairs_with(patch: Patch, change: Callable[[ContactPair], dict[str, Any]]) -> None:
    right = placing.pair

    def pair(*surfaces: Any, **options: Any) -> ContactPair:
        found = right(*surfaces, **options)
        return replace(found, **change(found))

    patch.setattr(placing, "pair", pair)


def even_weights(patch: Patch) -> None:
    """Nodes that all stand for the same length."""
    _pairs_with(patch, lambda pair: {"weights": np.full_like(pair.weights, pair.weights.mean())})


def smaller_gap(patch: Patch) -> None:
    """Distances of the geometry one per cent too small."""
    _pairs_with(patch, lambda pair: {"initial_gap": 0.99 * pair.initial_gap})


def strip_wears_where_it_meets(patch: Patch) -> None:
    """Depths put on the strip's nodes by interpolation, which keeps no area."""
    _pairs_with(
        patch,
        lambda pair: {"wear_projection": csr_array(interpolation(pair.x, pair.punch.degree, pair.strip.x[:, 0]))},
    )


def strip_does_not_wear(patch: Patch) -> None:
    """The strip's wear forgotten in the gap."""
    patch.setattr(ContactPair, "opening", lambda self, punch, strip: punch)


def collocated(patch: Patch) -> None:
    """Values picked at the punch's nodes in place of the mortar."""

    def transfer(patches: Any) -> Any:
        first, second = patches[0].first, patches[0].second
        return csr_array(interpolation(second.s[:, 0], second.degree, first.s[:, 0]))

    patch.setattr(sys.modules["fenwear.surfaces.pair"], "dual_transfer", transfer)


def half_distance(patch: Patch) -> None:
    """A sliding distance of u0 in place of 2 u0."""
    right = Motion.sliding
    patch.setattr(Motion, "sliding", lambda self, exponent=1.0: right(self, exponent) / 2)


def half_speed(patch: Patch) -> None:
    """Heat of half the sliding speed."""
    right = Motion.mean_speeds
    patch.setattr(Motion, "mean_speeds", lambda self, steps: right(self, steps) / 2)


def steeper_wear(patch: Patch) -> None:
    """Wear that grows a little faster than the pressure: b = 1.1."""

    right = Wear.phases

    def phases(self: Wear, *arguments: Any) -> Any:
        found = right(self, *arguments)
        law = replace(found.punch.law, exponent=1.1 * found.punch.law.exponent)
        return replace(found, punch=replace(found.punch, law=law))

    patch.setattr(Wear, "phases", phases)


def half_limit(patch: Patch) -> None:
    """A limit of explicit steps twice too high."""
    right = wear_cases.stability_number
    patch.setattr(wear_cases, "stability_number", lambda system: right(system) / 2)


def other_share(patch: Patch) -> None:
    """The strip's share of the heat for the punch."""
    right = HeatExchange._make_flux_map

    def make(self: HeatExchange, kinds: Any, conductance: Any) -> Any:
        heat = self.heat
        self.heat = heat.model_copy(update={"partition": 1 - heat.partition})
        try:
            return right(self, kinds, conductance)
        finally:
            self.heat = heat

    patch.setattr(HeatExchange, "_make_flux_map", make)


def thermal_modulus_without_poisson(patch: Patch) -> None:
    """E alpha in place of E alpha / (1 - nu) and E alpha / (1 - 2 nu)."""

    right = both_bodies.isotropic

    def isotropic(body: Any, regions: Any, materials: Any, kind: Any) -> Isotropic:
        of_region = {region: materials[name] for region, name in regions.items()}
        modulus = {r: m.young * (m.expansion or 0.0) for r, m in of_region.items()}
        return replace(
            right(body, regions, materials, kind), thermal_modulus=elastic_material.region_field(body, modulus)
        )

    patch.setattr(both_bodies, "isotropic", isotropic)


def material_the_other_way(patch: Patch) -> None:
    """The strip's material moves against the sliding direction."""
    right = HeatBody.step
    patch.setattr(HeatBody, "step", lambda self, velocity, *rest, **how: right(self, -velocity, *rest, **how))


def longer_step(patch: Patch) -> None:
    """Time steps one per cent too long."""
    right = HeatBody.step
    patch.setattr(
        HeatBody,
        "step",
        lambda self, velocity, time, *rest, **named: right(self, velocity, 1.01 * time, *rest, **named),
    )


def forgotten_heat(patch: Patch) -> None:
    """What the strip's material carries away is left out of the balance."""
    right = HeatExchange._account

    def account(self: HeatExchange, *args: Any, **options: Any) -> Any:
        terms = right(self, *args, **options)
        terms[TERMS.index("carried")] = 0
        return terms

    patch.setattr(HeatExchange, "_account", account)


@pytest.mark.parametrize(
    ("name", "break_it"),
    [
        ("elasticity", lame_of_the_other_plane),
        ("patch", collocated),
        ("hertz", punch_without_poisson),
        ("sliding-cylinder", opposite_friction),
        ("sliding-punch", opposite_friction),
        ("flat-punch", even_weights),
        ("cylinder-on-flat", smaller_gap),
        ("rounded-punch", smaller_gap),
        ("equilibrium-of-contact", opposite_moment),
        ("optimum-table", opposite_moment),
        ("optimum-linear", opposite_moment),
        ("optimum-power", opposite_moment),
        ("wear-volume", strip_wears_where_it_meets),
        ("equilibrium", opposite_moment),
        ("galin", half_distance),
        ("galin", strip_does_not_wear),
        ("one-way", steeper_wear),
        ("cyclic", steeper_wear),
        ("explicit-limit", half_limit),
        ("conduction", material_the_other_way),
        ("time-steps", longer_step),
        ("thermal-strain", thermal_modulus_without_poisson),
        ("free-expansion", thermal_modulus_without_poisson),
        ("bimetal", thermal_modulus_without_poisson),
        ("periodic-flux", longer_step),
        ("jaeger", material_the_other_way),
        ("open-strip", material_the_other_way),
        ("conductance", other_share),
        ("burton", thermal_modulus_without_poisson),
        ("square-source", material_the_other_way),
        ("flash", kernels_the_other_way),
        ("energy", half_speed),
        ("energy", forgotten_heat),
    ],
    ids=lambda value: value if isinstance(value, str) else value.__name__,
)
def test_it_is_found(monkeypatch: pytest.MonkeyPatch, name: str, break_it: Callable[[Patch], None]) -> None:
    """The case computes to its end and says that it differs."""
    break_it(monkeypatch)
    (outcome,) = run_cases(registered([name]))
    assert not outcome.failed, outcome.result.note
    assert outcome.verdict == "differs"


@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="needs several ranks")
@pytest.mark.mpi
def test_ranks_that_differ_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A friction that depends on the number of ranks, by a part in a million."""

    def contact(self: Tribosystem, directions: tuple[int, ...]) -> CondensedContact:
        return CondensedContact(
            [
                SlidingContact(self.elastic.interface, self.phases.middle_ratio(d) * (1 + 1e-6 * self.bodies.comm.size))
                for d in directions
            ]
        )

    monkeypatch.setattr(Tribosystem, "contact", contact)
    (outcome,) = run_cases(registered(["ranks"]))
    assert outcome.verdict == "differs"
