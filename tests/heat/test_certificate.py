"""Reduced temperatures are those of the whole mesh to the tolerance asked for, and the number told says so."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from fenwear import Tribosystem, assemble, load_case
from fenwear.checks import Seen, fineness_text
from fenwear.heat.fitted import rigid_gaps
from fenwear.heat.heat_exchange import TERMS, HeatExchange
from fenwear.heat.prepare import opened_gap
from fenwear.steps.stick_heat import free_expansion
from fenwear.system import expansions, with_exchange, with_reduced_heat

COARSE = ("geometry.degree=2", "geometry.parameters.strip_length=160", "geometry.parameters.strip_height=16")


def _random(way: str, random: np.random.Generator) -> Tribosystem:
    """Return a case whose thermal lengths and times, losses and sharing are anything."""
    settings = [
        *COARSE,
        f"heat.convection={10 ** random.uniform(1, 4)} W/(m^2*K)",
        f"heat.conductance={10 ** random.uniform(1, 5)} W/(m^2*K)",
        f"heat.steps={random.integers(1, 9)}",
        f"geometry.parameters.elements_along_contact={2 * random.integers(2, 5)}",
    ]
    fast = 10 ** random.uniform(-1, 2)
    if way == "to and fro":
        amplitude = 10 ** random.uniform(-0.5, 1.5)
        settings += [f"motion.amplitude={amplitude}", f"geometry.parameters.overlap={amplitude}"]
        settings += [f"motion.angular_frequency={fast}"]
    else:
        slides = f"speed={10 ** random.uniform(0, 2.5)}, duration={1 / fast}"
        settings += [f"motion={{kind='one-way', direction='{random.choice(['leftward', 'rightward'])}', {slides}}}"]
    return assemble(load_case("example2-heat", settings))


def _over(exchange: HeatExchange, pressures: np.ndarray, rigid: np.ndarray) -> list[np.ndarray]:
    """Return contact temperatures and gaps, beside a rigid motion, after half-cycles of pressures (k, n)."""
    state, found = exchange.initial(), []
    q = np.linalg.qr(rigid)[0]
    for number, pressure in enumerate(pressures):
        phase = number % len(exchange.plans)
        state, terms = exchange.half_cycle(state, phase, pressure, exchange.conductance(pressure))
        assert abs(terms[0] - terms[1 : len(TERMS)].sum()) < 1e-8 * terms[0]
        gap = exchange.gap(state, phase)
        found.append(np.array([*exchange.contact_temperatures(state, phase), gap - q @ (q.T @ gap)]))
    return found


@pytest.mark.parametrize("way", ["to and fro", "one way"])
@pytest.mark.parametrize("seed", [29, *(pytest.param(k, marks=pytest.mark.slow) for k in range(6))])
def test_against_the_whole_mesh(way: str, seed: int) -> None:
    """Contact temperatures and the thermal gap at every node are those of all nodes, in random cases."""
    random = np.random.default_rng(seed)
    system = _random(way, random)
    pressures = random.uniform(0, 20, (4, len(system.pair.weights)))
    pressures[random.random(pressures.shape) < 0.2] = 0.0
    rigid = np.stack([np.ones(len(system.pair.x)), system.pair.x], axis=1)
    whole = _over(with_exchange(system, reduced=False).exchange, pressures, rigid)
    reduced = with_reduced_heat(system)
    small = _over(reduced.exchange, pressures, rigid)
    assert system.case.heat is not None
    allowed = system.case.heat.reduction_difference
    fineness = reduced.exchange.fineness
    assert fineness.difference <= allowed
    for one, other in zip(small, whole, strict=True):
        scale = np.abs(other).max(axis=1, keepdims=True)
        assert (np.abs(one - other) <= allowed * scale).all(), (np.abs(one - other) / scale).max(axis=1)


def test_the_gap_by_rows_and_by_displacements() -> None:
    """The certificate's gap is that of sliding, by a row for each node, where stick has displacements."""
    system = assemble(load_case("example2-heat", COARSE))
    elastic, warm = (system.bodies.punch, system.bodies.strip), system.bodies.heat
    assert warm is not None
    for body, other, rows in zip(elastic, warm, expansions(system.elastic, in_middle=True), strict=True):
        x = other.space.tabulate_dof_coordinates()[: other.owned]
        fields = np.column_stack([np.ones(len(x)), x[:, 0] ** 2, np.sin(x[:, 1])])
        moved = partial(free_expansion, body, other)
        by_row, by_displacement = (opened_gap(other, system.pair, rows, way)(fields) for way in (None, moved))
        rigid = rigid_gaps(other, system.pair.punch.x)
        apart = by_displacement - by_row
        np.testing.assert_allclose(apart - rigid @ (rigid.T @ apart), 0, atol=1e-9 * np.abs(by_row).max())


def test_a_basis_that_cannot_hold_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """One try alone, at a rough tolerance: the difference stands in what is told, and in a warning by its key."""
    for module in ("fitted", "passing_strip"):
        monkeypatch.setattr(f"fenwear.heat.{module}.TRIES", 1)
    system = assemble(load_case("example2-heat", [*COARSE, "heat.reduction_tolerance=0.1"]))
    fineness = system.exchange.fineness
    assert fineness.difference > 5e-3
    (told,) = (text for text in Seen.of_system(system).warnings("heat") if "whole mesh" in text)
    assert told.startswith("heat.reduction_tolerance: ")
    assert "heat.reduction_difference = 0.002" in told
    assert f"{100 * fineness.difference:.2g} %" in fineness_text(system.exchange)
