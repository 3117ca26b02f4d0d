"""The fluxes at the contact: by a factor, and by that of other conductances."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear.common.arrays import Array
from fenwear.heat.contact_fluxes import Exchanged, FluxFactor, FluxUpdate

NODES = 12


def step(conductance: Array, convection: float) -> Exchanged:
    """Return a step of two bodies whose contact temperatures answer to fluxes anyhow, the second not symmetrically."""
    random = np.random.default_rng(3)
    first, second = random.random((2, NODES, NODES)) * 0.1 + np.eye(NODES)
    return Exchanged((first + first.T, second), conductance, convection, 0.3, 0.2)


@pytest.mark.parametrize("convection", [0.0, 0.7])
@pytest.mark.parametrize("kind", ["perfect", "finite", "open here and there", "mixed", "open"])
def test_all_obey_the_equations_of_the_contact(kind: str, convection: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """With theta_i = bare_i + T_i q_i, each node exchanges what its conductance says, and no heat is lost."""
    conductance = np.full(NODES, np.inf if kind in ("perfect", "open here and there") else 2.5)
    conductance[{"open here and there": slice(1, None, 3), "mixed": slice(2, 5), "open": slice(None)}.get(kind, [])] = (
        np.nan
    )
    if kind == "mixed":
        conductance[7:] = np.inf
    one, random = step(conductance, convection), np.random.default_rng(4)
    bare, heat, ambient = random.random((2 * NODES, 3)), random.random((NODES, 3)), 0.6
    conducts, generated = ~np.isnan(conductance), (1 - one.debris) * heat
    other = np.where(np.arange(NODES) % 2, np.nan, 1.5)
    other[3:6] = conductance[3:6]
    monkeypatch.setattr("fenwear.heat.contact_fluxes.UPDATED", 1.0)
    updated = FluxFactor(step(other, convection)).updated(one)
    assert isinstance(updated, FluxUpdate)
    for fluxes in (FluxFactor(one), updated):
        first, second = np.split(fluxes.of(bare, heat, ambient), 2)
        hot, cold = bare[:NODES] + one.responses[0] @ first, bare[NODES:] + one.responses[1] @ second
        np.testing.assert_allclose((first + second)[conducts], generated[conducts], atol=1e-12)
        perfect, finite = np.isinf(conductance), np.isfinite(conductance)
        np.testing.assert_allclose(hot[perfect], cold[perfect], atol=1e-12)
        passed = one.partition * generated - first
        np.testing.assert_allclose(passed[finite], 2.5 * (hot - cold)[finite], atol=1e-12)
        for flux, surface in ((first, hot), (second, cold)):
            np.testing.assert_allclose(flux[~conducts], -convection * (surface - ambient)[~conducts], atol=1e-12)
        alone = fluxes.of(bare[:, 0], heat[:, 0], ambient)
        np.testing.assert_allclose(alone, np.concatenate([first[:, 0], second[:, 0]]), atol=1e-12)
        rows = random.random((4, 2 * NODES))
        seen = fluxes.sources(rows).of(bare, heat, ambient)
        np.testing.assert_allclose(seen, rows @ np.concatenate([first, second]), atol=1e-12)


def test_a_factor_serves_while_few_nodes_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same conductances need nothing; too many others need a factor of their own; what comes back is known."""
    monkeypatch.setattr("fenwear.heat.contact_fluxes.UPDATED", 0.25)
    conductance = np.full(NODES, np.inf)
    factor = FluxFactor(step(conductance, 0.7))
    assert factor.updated(step(conductance.copy(), 0.7)) is factor
    bare, found = np.random.default_rng(5).random(2 * NODES), []
    for nodes in ([1], [1, 4], [6, 7, 8], [2, 9, 11], [1]):  # more than are remembered
        now = conductance.copy()
        now[nodes] = np.nan
        one = step(now, 0.7)
        updated = factor.updated(one)
        assert updated is not None
        found.append(updated.of(bare, np.zeros(len(bare) // 2), 0.3))
        np.testing.assert_allclose(found[-1], FluxFactor(one).of(bare, np.zeros(len(bare) // 2), 0.3), atol=1e-12)
    np.testing.assert_array_equal(found[0], found[-1])
    now[:4] = np.nan
    assert factor.updated(step(now, 0.7)) is None
