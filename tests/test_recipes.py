"""The recipes of CONTRIBUTING.md, walked through: what one adds is known by its name, and does what it says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import (
    CaseError,
    State,
    assemble,
    load_case,
    make_case,
    march,
    register_contact_law,
    register_law,
    steady,
)
from fenwear.case.contact_table import CONTACT_LAWS
from fenwear.case.dependence import forget_laws
from fenwear.steps.gross_sliding import GrossSliding
from fenwear.studies.run import run_case
from fenwear.surfaces import patches
from fenwear.surfaces.patches import CHARTS, Side
from fenwear.system import contact_laws, place_case

# ---- A law of contact: the strip is dragged back under a share of its load, as the tool of a shaping machine is.

SHARE = 0.25
SMALL = [
    "geometry.parameters.elements_along_contact=6",
    "geometry.degree=2",
    "output.report=false",
    "output.uncertainty=false",
]


class DraggedBack(GrossSliding):
    """Gross sliding, back under a share of the load."""

    name = "dragged-back"

    def half_cycles(self, system: Any, watch: Any, loading: Any, *, implicit: bool) -> Any:
        """Return the step of one half-cycle, under its own load."""

        def own(done: float) -> float:
            return float(loading(done)) * (SHARE if int(done) % 2 else 1.0)

        return super().half_cycles(system, watch, own, implicit=implicit)

    def jumps(self, *_: Any) -> Any:
        """Refuse what is not written."""
        raise CaseError([])


@pytest.fixture
def dragged() -> Iterator[str]:
    """Register the law, and forget it."""
    register_contact_law(DraggedBack.name, DraggedBack())
    yield DraggedBack.name
    del contact_laws.LAWS[DraggedBack.name]
    CONTACT_LAWS.discard(DraggedBack.name)


def test_a_law_of_contact(dragged: str, tmp_path: Path) -> None:
    """Two cycles wear k s (1 + share) F / 2: of two strokes one has the share; a run goes its way, too."""
    own, known = (
        load_case("example1", [*SMALL, f"contact.law='{name}'", "run.half_cycles=4"])
        for name in (dragged, "gross-sliding")
    )
    volumes = []
    for case in (own, known):
        system = assemble(case)
        assert system.law.name == case.contact.law
        assert not system.law.sticks
        last = list(march(system, 4))[-1]
        volumes.append(float(last.totals.of("volume_punch")[-1]))
        assert last.load_factor.tolist() == pytest.approx([1, SHARE if case is own else 1] * 2)
    assert volumes[0] == pytest.approx(volumes[1] * (1 + SHARE) / 2, rel=1e-9)
    assert make_case(own.resolved()) == own
    summary, _ = run_case(own, output=tmp_path / "run", log=lambda _: None, progress="none")
    assert summary["punch"]["worn_volume_mm3"] == pytest.approx(volumes[0], rel=1e-12)
    assert steady(assemble(own)).pressure.max() > 0  # what it does not change it has of gross sliding


def test_names_of_laws_that_are_none() -> None:
    with pytest.raises(CaseError, match=r"contact\.law:"):
        load_case("example1", ["contact.law=dragged"])
    for name in ("coulomb", "auto", "two words"):
        with pytest.raises(CaseError, match=r"contact\.law"):
            register_contact_law(name, DraggedBack())


# ---- A chart: an arc unrolled around its middle, in place of graphs over planes.

BORE = """
[geometry]
file = "bushing.geo"
degree = 2
order = 2
parameters = {contact_angle = 80, elements_along_contact = 24, clearance = 0.2}
[materials.steel]
young = 2e5
poisson = 0.3
[punch]
regions = {punch_body = "steel"}
supports = [{on = "punch_top", fix = ["x"]}]
loads = [{on = "punch_top", force = [0, -10]}]
[strip]
regions = {strip_body = "steel"}
supports = [{on = "strip_bottom", fix = ["x", "z"]}]
[wear.punch]
coefficient = 1e-8
[motion]
kind = "rotation"
axis = [0, 1, 0]
angular_speed = 1
duration = 1
[run]
half_cycles = 1
"""


def unrolled(own: Side, other: Side) -> list[patches.Patch] | None:
    """Return an arc of a plane model as one patch, by the angle around the middle times a radius; None of others."""
    middle = patches._middle(own.surface, own.normal)
    if own.surface.dim != 2 or middle is None:
        return None
    towards = middle.ways(own.middles).mean(axis=0)
    parts = []
    for side in (own, other):
        x = side.trace - middle.point
        arc = middle.radius * np.arctan2(x @ np.array([towards[1], -towards[0]]), x @ towards)
        parts.append(side.charted(arc[:, None], np.ones(len(side.normal), bool)))
    return [patches.Patch.of(*parts)]


def test_a_chart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One patch in place of three sees the same contact: areas to rounding, gaps the nearer the finer the mesh."""
    (tmp_path / "bore.toml").write_text(BORE)
    errors = []
    for elements in (24, 48):
        case = load_case(tmp_path / "bore.toml", [f"geometry.parameters.elements_along_contact={elements}"])
        found = []
        for charts in (CHARTS, [unrolled, *CHARTS]):
            monkeypatch.setattr(patches, "CHARTS", charts)
            between = place_case(case).pair
            found.append((between, len(patches.patches(between.punch, between.strip))))
        (ready, three), (mine, one) = found
        assert (three, one) == (3, 1)
        np.testing.assert_allclose(mine.transfer.sum(axis=1), 1, rtol=1e-12)
        np.testing.assert_allclose(mine.weights.sum(), ready.weights.sum(), rtol=1e-6)
        errors.append(np.abs(mine.initial_gap - ready.initial_gap).max() / np.ptp(ready.initial_gap))
    assert errors[1] < 0.3 * errors[0] < 1e-4


# ---- A wear law with a state of its own: an oxide film that grows again after sliding has rubbed it off.

GROWN, RUBBED, LEAST, MOST = 2.0, 0.05, 1e-8, 5e-8  # s, 1/mm, 1/MPa


@pytest.fixture
def oxide() -> Iterator[str]:
    """Register the law, and forget it."""
    film = State(
        lambda now: (1 - now["oxide"]) / GROWN - RUBBED * now["v"] * now["oxide"],
        of=["v"],
        initial=1.0,
        slope=lambda now: -1 / GROWN - RUBBED * now["v"],
    )
    register_law("oxidative", lambda now: MOST + (LEAST - MOST) * now["oxide"], states={"oxide": film})
    yield "wear.punch.coefficient={law='oxidative', unit='1/MPa'}"
    forget_laws()


def test_a_wear_law_with_a_state_of_its_own(oxide: str, tmp_path: Path) -> None:
    """The film follows its closed form, the volume its integral; in the end growth and rubbing balance."""
    slides = "motion={kind='one-way', direction='rightward', speed='20 mm/s', duration='0.1 s'}"
    case = load_case("example1", [*SMALL, oxide, slides, "contact.friction=0.1", "run.half_cycles=20"])
    rate = 1 / GROWN + RUBBED * 20
    rest, t = 1 / GROWN / rate, 0.1 * 20
    film = rest + (1 - rest) * np.exp(-rate * t)
    system = assemble(case)
    last = list(march(system, 20))[-1]
    assert last.between[-1, 0] == pytest.approx(film, rel=1e-12)
    over = rest * t + (1 - rest) * -np.expm1(-rate * t) / rate  # the integral of the film
    volume = (
        (MOST * t + (LEAST - MOST) * over) * 20 * system.rigid.mean_pressure * float(system.pair.weights.sum()) * 10
    )
    assert float(last.totals.of("volume_punch")[-1]) == pytest.approx(volume, rel=1e-3)
    assert steady(system).states["oxide"] == pytest.approx(rest, rel=1e-10)
    summary, _ = run_case(case, output=tmp_path / "run", log=lambda _: None, progress="none")
    assert summary["states"]["oxide"]["mean"] == pytest.approx(film, rel=1e-9)
