"""Tensors of sliding: circles, straight ways and crosses, and laws that know of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import CaseError, Tribosystem, jump, load_case, march
from fenwear.case import WearLaw
from fenwear.laws.sliding_tensors import SlidingTensor, SlidingWays

PATHS = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "contact.friction=0")


def tensor(ways: list[tuple[float, float]]) -> SlidingTensor:
    """Return that of ways (work, angle in degrees) in the plane z = 0."""
    work, angle = np.array(ways).T
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0 * angle]).T
    return SlidingTensor(np.einsum("k,ka,kb->ab", work, along, along)[None])


def test_ratio_and_direction() -> None:
    """A cross of works 3 and 1 has a quarter across; directions do not depend on which way is slid."""
    cross = tensor([(3, 30), (1, 120)])
    assert cross.ratio[0] == pytest.approx(0.25, abs=1e-15)
    assert cross.work[0] == pytest.approx(4)
    np.testing.assert_allclose(cross.direction[0], [np.cos(np.pi / 6), 0.5, 0], atol=1e-15)
    np.testing.assert_allclose(tensor([(1, 30), (2, 210), (1, 300)]).values, cross.values, atol=1e-15)
    assert tensor([(0, 0)]).ratio[0] == 0


def circle(count: int) -> str:
    angle = np.linspace(0, 2 * np.pi, count + 1)
    rows = [[float(t), float(2 * np.cos(a)), float(2 * np.sin(a))] for t, a in zip(angle, angle, strict=True)]
    rows[-1][1:] = rows[0][1:]
    return f"motion={{kind='cycle', columns=['time (s)', 'shift_x (mm)', 'shift_y (mm)'], rows={rows}}}"


LINE = "motion={kind='cycle', columns=['time (s)', 'shift_x (mm)', 'shift_y (mm)'], rows=[[0,0,0],[1,2,1],[2,0,0]]}"


def test_circles_and_lines(assembled: Callable[..., Tribosystem]) -> None:
    """Exactly 1/2 and 0, on both materials; the way is the polygon's."""
    round_, straight = (assembled("example1", *PATHS, motion) for motion in (circle(12), LINE))
    np.testing.assert_allclose(round_.sliding.path.sum(axis=0), 12 * 4 * np.sin(np.pi / 12), rtol=1e-12)
    for of in (SlidingWays.tensor, SlidingWays.tensor_of_strip):
        covered = of(round_.phases.ways).work > 1e-9
        np.testing.assert_allclose(of(round_.phases.ways).ratio[covered], 0.5, atol=1e-7)
        np.testing.assert_allclose(of(straight.phases.ways).ratio, 0, atol=1e-7)
    np.testing.assert_allclose(
        straight.phases.ways.tensor().direction, np.tile([2, 1, 0] / np.sqrt(5), (17, 1)), atol=1e-12
    )


def test_laws_of_cross_shear_and_mean_pressure(assembled: Callable[..., Tribosystem]) -> None:
    """The coefficient is taken at cs = 1/2 on a circle; with the mean pressure the law is quadratic."""
    law = "wear.punch={coefficient={expression='1e-9*(1 + 10*cs)'}}"
    *_, last = march(assembled("example1", *PATHS, circle(8), law), 2)
    way = 8 * 4 * np.sin(np.pi / 8)
    np.testing.assert_allclose(last.worn_area_increment[0], 6e-9 * way * 1e3, rtol=1e-9)
    # A cycle later pressures are not the same in all directions: near 1/2 the ratio takes the root of their difference.
    np.testing.assert_allclose(last.worn_area_increment, 6e-9 * way * 1e3, rtol=1e-5)
    law = "wear.punch={coefficient={expression='1e-14*pm', unit='1/MPa'}}"
    *_, last = march(assembled("example1", *PATHS, circle(8), law), 3)
    pressure = last.pressure[-1]
    depth = last.wear[-1] - last.wear[-2]
    np.testing.assert_allclose(depth, 1e-14 * pressure**2 * way, rtol=1e-6)


def test_jumps_with_such_laws(assembled: Callable[..., Tribosystem]) -> None:
    """On a circle, in many cycles at once, all wears as with the law that cs = 1/2 makes of it."""
    ends = []
    for law in ("coefficient={expression='1e-9*(1 + 10*cs)'}", "coefficient=6e-9"):
        *_, last = jump(assembled("example1", *PATHS, circle(8), f"wear.punch={{{law}}}"), 1000, tolerance=1e-3)
        ends.append(last.end)
    depth = ends[1].worn.punch
    np.testing.assert_allclose(ends[0].worn.punch, depth, rtol=0, atol=2e-4 * depth.max())
    assert np.ptp(depth) > 0.01 * depth.max()


def test_wear_per_area(assembled: Callable[..., Tribosystem]) -> None:
    """Whatever the pressure all that touches loses k_A times its way."""
    *_, last = march(assembled("example1", *PATHS, "wear.punch={per_area=2e-9}", "motion.positions=1"), 4)
    np.testing.assert_allclose(last.wear[-1], 4 * 2e-9 * 3.0, rtol=1e-12)


def test_bad_laws_per_area() -> None:
    for wrong, told in (
        ({"per_area": 1e-9, "coefficient": 1e-9}, "give one of"),
        ({"per_area": 1e-9, "pressure_cap": 3.0}, "per_area: expected without"),
        ({"coefficient": 1e-9, "touching_from": 3.0}, "touching_from: expected with per_area"),
    ):
        with pytest.raises(ValueError, match=told):
            WearLaw.model_validate(wrong)
    with pytest.raises(CaseError, match=r"wear\.punch\.per_area: .*1"):
        load_case("example1", ["wear.punch={per_area=1e-9, pressure_exponent=2}"])


def test_debris_is_lost_by_cross_shear(assembled: Callable[..., Tribosystem]) -> None:
    """On a circle, where cs = 1/2 everywhere, as by the life that the law has there."""
    found = []
    for life in ("{expression='50*(1 + 10*cs)', unit='mm'}", "'300 mm'"):
        body = f"contact.third_body={{share=0.5, life={life}}}"
        *_, last = march(assembled("example1", *PATHS, circle(8), body), 3)
        found.append(last.between)
    assert found[1][0, 0].min() > 0
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=1e-9)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-4)  # near 1/2, see above
