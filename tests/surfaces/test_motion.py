"""The exact integrals of the speed."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

from fenwear.case import OneWay, Oscillation, Reciprocating, Rotation, Tabulated
from fenwear.surfaces.motion import Motion, make_motion
from fenwear.surfaces.sliding_field import SlidingField


@pytest.mark.parametrize("a", [0.3, 0.5, 1.0, 1.7, 2.0, 3.0])
def test_reciprocating_against_quadrature(a: float) -> None:
    """The integral of (u0 omega |sin omega t|)^a over half a period, equation (10), by adaptive quadrature."""
    u0, omega = 1.5, 10.0
    motion = make_motion(Reciprocating(kind="reciprocating", amplitude=u0, angular_frequency=omega))
    exact, _ = quad(lambda t: (u0 * omega * abs(np.sin(omega * t))) ** a, 0, np.pi / omega, epsabs=0, epsrel=1e-11)
    assert motion.sliding(a)[0] == pytest.approx(exact, rel=1e-9)
    assert motion.phases[0].duration == pytest.approx(np.pi / omega, rel=1e-15)
    assert motion.directions == (1, -1)


def test_sliding_distance_of_a_half_cycle() -> None:
    """For a = 1 the strip slides exactly 2 u0, at any frequency."""
    for omega in (0.1, 10.0, 1e4):
        motion = make_motion(Reciprocating(kind="reciprocating", amplitude=1.5, angular_frequency=omega))
        assert motion.sliding()[0] == pytest.approx(3.0, rel=1e-14)


@pytest.mark.parametrize(("direction", "d"), [("rightward", 1), ("leftward", -1)])
def test_one_way(direction: str, d: int) -> None:
    """Constant speed: v^a times the duration."""
    motion = make_motion(OneWay(kind="one-way", direction=direction, speed=200, duration=0.1))  # type: ignore[arg-type]
    assert motion.directions == (d,)
    assert motion.sliding(2)[0] == pytest.approx(4000, rel=1e-14)


@pytest.mark.parametrize("steps", [3, 5, 7])
def test_steps_at_one_speed_are_equal_to_the_last_digit(steps: int) -> None:
    """A constant speed is that of every step, however many: they share the operators of heat with it."""
    for v in (10.0, 200 / 3, 1000 / 7):
        one_way = OneWay(kind="one-way", direction="rightward", speed=v, duration=0.05)
        turning = Rotation(kind="rotation", direction="clockwise", angular_speed=v, duration=0.05)
        for description in (one_way, turning):
            speeds = make_motion(description).mean_speeds(steps)
            assert np.unique(speeds).tolist() == [v * 0.05 / 0.05]


def speed(profile: str, t: float) -> float:
    """v(t) of u0 = 1.5 mm, period 2 s, ramp 0.25 by its definition."""
    t %= 1.0
    match profile:
        case "sinusoidal":
            return 1.5 * np.pi * abs(np.sin(np.pi * t))
        case "triangular":
            return 3.0
    return 4.0 * min(t / 0.25, 1.0, (1 - t) / 0.25)


def to_and_fro(profile: str, positions: int) -> Motion:
    ramp = 0.25 if profile == "trapezoidal" else None
    return make_motion(
        Reciprocating(
            kind="reciprocating",
            amplitude=1.5,
            period=2.0,
            profile=profile,  # type: ignore[arg-type]
            ramp=ramp,
            positions=positions,
        )
    )


@pytest.mark.parametrize("positions", [1, 4, 7])
@pytest.mark.parametrize("profile", ["sinusoidal", "triangular", "trapezoidal"])
def test_phases_against_quadrature(profile: str, positions: int) -> None:
    """The sliding integral of each phase for a = 1 and a = 1.7; offsets are the middles of what is slid there."""
    motion = to_and_fro(profile, positions)
    edges = np.linspace(0, 2, 2 * positions + 1)
    for a in (1.0, 1.7):
        exact = [
            quad(lambda t, a=a: speed(profile, t) ** a, low, high, points=[0.25, 0.75, 1.25, 1.75], limit=200)[0]
            for low, high in itertools.pairwise(edges)
        ]
        np.testing.assert_allclose(motion.sliding(a), exact, rtol=1e-7)
    assert motion.sliding().sum() == pytest.approx(6.0, rel=1e-14)
    offsets = [phase.offset for phase in motion.phases]
    if positions == 1:
        assert offsets == [0, 0]
        return
    distances = motion.sliding()[:positions]
    np.testing.assert_allclose(offsets[:positions], -1.5 + np.cumsum(distances) - distances / 2, atol=1e-11)
    assert offsets[positions:] == offsets[:positions][::-1]
    np.testing.assert_allclose(motion.mean_speeds(3).sum() * motion.phases[0].duration / 3, 6.0, rtol=1e-13)


def test_table() -> None:
    """Strokes of one direction each; a rest belongs to the stroke before it; offsets from the middle of the range."""
    description = Tabulated(kind="table", times=(0, 1, 2, 3, 5), displacements=(0, 4, 4, 2, 0), positions=2)
    motion = make_motion(description)
    assert motion.stroke_directions == (1, -1)
    np.testing.assert_allclose([phase.offset for phase in motion.phases], [0, 2, 0.75, -1.25])
    np.testing.assert_allclose(motion.sliding(), [4, 0, 2.5, 1.5])
    np.testing.assert_allclose(motion.time(np.array([1, 2, 3])), [2, 5, 7])


def test_rotation_and_oscillation() -> None:
    """Angles take the place of lengths: a steady turn, and a stroke of 2 phi0 with the speeds of a translation's."""
    turn = make_motion(Rotation(kind="rotation", direction="clockwise", angular_speed=4.0, duration=0.5))
    assert turn.directions == (-1,)
    assert turn.sliding(2)[0] == pytest.approx(8.0, rel=1e-14)
    assert turn.reach == 0
    strokes = {"period": 2.0, "profile": "triangular", "positions": 5}
    angles = make_motion(Oscillation(kind="oscillation", amplitude=0.3, **strokes))  # type: ignore[arg-type]
    lengths = make_motion(Reciprocating(kind="reciprocating", amplitude=0.3, **strokes))  # type: ignore[arg-type]
    assert angles.phases == lengths.phases


def test_field_of_a_rotation() -> None:
    """v = omega x (x - c): its size is the distance from the axis, its direction lies across the arm."""
    field = SlidingField(turn=(0.0, 0.0, 1.0), centre=(1.0, 0.0, 7.0))
    x = np.array([[3.0, 0.0, 0.0], [1.0, 4.0, 0.0], [1.0, 0.0, 2.0]])
    np.testing.assert_allclose(field.rate(x, np.broadcast_to([0.0, 0.0, 1.0], x.shape)), [2, 4, 0], atol=1e-15)
    normal = np.broadcast_to([0.0, 0.0, 1.0], x.shape)
    np.testing.assert_allclose(field.direction(x, normal), [[0, 1, 0], [-1, 0, 0], [0, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(field.placement(np.pi / 2).points(x)[0], [1, 2, 0], atol=1e-14)
    # In a ring, (r, z), the sliding goes out of the plane.
    ring = SlidingField(turn=(0.0, 0.0, 1.0))
    np.testing.assert_allclose(ring.direction(np.array([[5.0, 0.0]]), np.array([[0.0, 1.0]])), [[0, 1, 0]])
