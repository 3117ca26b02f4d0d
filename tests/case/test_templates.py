"""Templates: commented cases of the usual tests that read, mesh and wear as they say."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from fenwear import assemble, jump, load_case, make_case, march, steady
from fenwear.case.templates import fill_in, find_template, template_names, values, write_case_of
from fenwear.common.errors import CaseError

USUAL = [
    *("ball-on-disc", "ball-on-flat", "block-on-ring", "brake-pad"),
    *(
        "bushing",
        "crossed-cylinders",
        "cylinder-on-flat",
        "disc-brake",
        "fretting",
        "pin-on-disc",
        "plain-bearing",
        "two-bushings",
    ),
]


def case_of(name: str, *settings: str) -> object:
    return make_case(tomllib.loads(fill_in(find_template(name), settings)))


def test_names() -> None:
    assert template_names() == USUAL


@pytest.mark.parametrize("name", USUAL)
def test_reads_and_explains(name: str) -> None:
    """Each is a valid case whose first words say which body is the punch, and whose every line fits."""
    template = find_template(name)
    text = fill_in(template)
    case = make_case(tomllib.loads(text))
    assert case.title
    first = text.partition("\n\n")[0]
    assert " is the punch" in first
    assert " is the strip: the body" in first
    assert all(len(line) <= 120 for line in text.splitlines()), max(text.splitlines(), key=len)
    assert "{{" not in text
    assert all(dimension.about for dimension in template.dimensions.values())


@pytest.mark.parametrize(("name", "setting"), [(n, d) for n in USUAL for d in find_template(n).dimensions])
def test_every_dimension_counts(name: str, setting: str) -> None:
    """Another value makes another case."""
    value = str(values(find_template(name))[setting])
    number, _, unit = value.partition(" ")
    other = f"{float(number) * 0.9:g} {unit}".strip() if setting not in ("revolutions", "turns", "cycles") else "777"
    assert case_of(name, f"{setting}={other}") != case_of(name)


def test_usual_values() -> None:
    """ASTM G133, procedure A: 25 N, strokes of 10 mm at 5 Hz, 100 m; G77's ring of 34.99 mm; G99's 0.1 m/s, 1,000 m."""
    ball = case_of("ball-on-flat")
    assert (ball.motion.amplitude, ball.motion.period, ball.run.half_cycles) == (5.0, 0.2, 10_000)
    assert ball.punch.loads[0].force == (0.0, 0.0, -25.0)
    ring = case_of("block-on-ring")
    assert ring.geometry.parameters["radius"] == 17.495
    for name in ("pin-on-disc", "ball-on-disc"):
        pin = case_of(name)
        distance = pin.run.half_cycles * pin.motion.duration * pin.motion.angular_speed * 16.0
        assert distance == pytest.approx(1e6, rel=1e-4)


@pytest.mark.parametrize(("name", "case"), [("brake-pad", "brake-pad"), ("disc-brake", "disc-brake-two-pads")])
def test_usual_dimensions_make_the_built_in_case(name: str, case: str) -> None:
    """One truth of a brake."""
    made, built_in = case_of(name).resolved(), load_case(case).resolved()
    assert made.pop("title") != built_in.pop("title")
    assert made == built_in


def test_what_is_wrong(tmp_path: Path) -> None:
    """Names the nearest template and dimension, or a built-in case, what was expected of a value, and a file there."""
    with pytest.raises(CaseError, match="did you mean 'block-on-ring'"):
        find_template("blok-on-ring")
    with pytest.raises(CaseError, match="base = 'drum-brake'"):
        find_template("drum-brake")
    with pytest.raises(CaseError, match=r"There are ball-on-disc, .*pin-on-disc"):
        find_template("")
    template = find_template("fretting")
    with pytest.raises(CaseError) as error:
        fill_in(template, ["lod=3", "load=-2 N", "load=3 mm", "radius", "cycles=many"])
    said = str(error.value)
    assert "did you mean 'load'?" in said
    assert "--set load: expected more than zero, got '-2 N'" in said
    assert "got '3 mm', which is of another kind" in said
    assert "expected dimension=value, got 'radius'" in said
    assert "--set cycles: expected a number, got 'many'" in said
    path = tmp_path / "mine.toml"
    write_case_of("fretting", path)
    with pytest.raises(CaseError, match=r"mine\.toml"):
        write_case_of("fretting", path)
    with pytest.raises(CaseError, match=r"expected a file ending in \.toml"):
        write_case_of("fretting", tmp_path / "mine")
    with pytest.raises(CaseError, match="cannot be written"):
        write_case_of("fretting", tmp_path / "no folder" / "mine.toml")


def test_bushing_steady_state() -> None:
    """A translating bushing wears evenly along the load where p = p0 cos theta; F / t = integral of p cos theta.

    So p0 = F / (t R (alpha + sin alpha cos alpha)), where all of +-alpha touches; friction adds nothing, p being even.
    """
    case = case_of("bushing", "load=20 kN", "clearance=0.002 mm")
    state = steady(assemble(case))
    pair = assemble(case, heat="none").pair
    radius, alpha = 10.0, np.radians(50.0)
    theta = np.arctan2(pair.normal[:, 0], pair.normal[:, 1])
    scale = 20e3 / (20.0 * radius * (alpha + np.sin(alpha) * np.cos(alpha)))
    np.testing.assert_allclose(state.pressure[0], scale * np.cos(theta), rtol=2e-3)


@pytest.mark.parametrize("wall", ["10 mm", "1 mm"])
def test_plain_bearing(wall: str) -> None:
    """Its contact is at the attitude angle; a bore that is held wears as a rigid one: h(s) by the arc that touches.

    The contact ends at cos t = c / (c + h), and p in proportion to cos on it carries N = F / sqrt(1 + mu^2), so that
    dh = k N ds / (b R (t + sin t cos t)).
    """
    case = case_of("plain-bearing", "revolutions=20000", f"wall={wall}")
    system = assemble(case)
    *_, last = jump(system, 20000, tolerance=0.005)
    x, weights, pressure = system.pair.punch.x, system.pair.weights, last.pressure[-1]
    angle = np.arctan2(x[:, 0], x[:, 1] + 0.05)
    assert angle @ (weights * pressure) / (weights @ pressure) == pytest.approx(-np.arctan(0.1), abs=np.radians(0.2))
    c, h, wanted = 0.05, np.linspace(0, 0.05, 100001)[1:], 2 * np.pi * 10 * 20000
    t = np.arccos(c / (c + h))
    slid = np.cumsum(20 * 10 * (t + np.sin(t) * np.cos(t)) / (1e-9 * 1000 / np.sqrt(1 + 0.1**2))) * (h[1] - h[0])
    rigid = np.interp(wanted, slid, h)
    assert last.wear[-1].max() == pytest.approx(rigid, rel=0.01)


@pytest.mark.slow
def test_ball_on_disc_wears_to_a_flat() -> None:
    """A cap of the volume k F s is worn off the ball: pi R h^2 deep, all over it alike but for what gives way."""
    tables = tomllib.loads(fill_in(find_template("ball-on-disc"), ["distance=400 m"]))
    tables["geometry"]["parameters"]["core"] = 0  # finer where it touches unworn, which is worn off
    case = make_case(tables)
    system = assemble(case, heat="none")
    *_, last = jump(system, case.run.half_cycles, tolerance=0.02)
    volume = 1e-9 * 10.0 * 4e5
    assert system.pair.weights @ last.wear[-1] == pytest.approx(volume, rel=1e-3)
    assert last.wear[-1].max() == pytest.approx(np.sqrt(volume / (np.pi * 5.0)), rel=2e-3)


def test_ring_wears_over_its_circumference() -> None:
    """What a block-on-ring wears off both bodies: k F s and its tenth; the ring's spreads over 2 pi R."""
    case = case_of("block-on-ring", "revolutions=200")
    system = assemble(case, heat="none")
    *_, last = jump(system, 200, tolerance=0.1)
    radius, width = 17.495, 6.35
    worn = 1e-8 * 134 / width * 2 * np.pi * radius * 200
    assert system.pair.weights @ last.wear[-1] == pytest.approx(worn, rel=2e-3)  # the scar is curved
    depth = last.wear_strip[-1]
    assert np.ptp(depth) < 1e-12 * depth.max()
    assert 2 * np.pi * radius * depth.max() == pytest.approx(0.1 * (system.pair.weights @ last.wear[-1]), rel=1e-9)


@pytest.mark.parametrize(
    "settings",
    [
        ["upper_diameter=0.45 mm", "lower_diameter=0.45 mm"],
        ["upper_diameter=0.45 mm", "lower_diameter=0.45 mm", "contact_width=0.25 mm"],
        ["lower_diameter=0.45 mm"],
        ["upper_diameter=20 mm", "lower_diameter=0.5 mm", "contact_width=0.3 mm"],
    ],
)
def test_thin_wires_are_meshed(settings: list[str]) -> None:
    """The flat is narrower than the wire, whatever its diameter and the width of the contact (issue 51, line 24)."""
    tables = tomllib.loads(fill_in(find_template("crossed-cylinders"), settings))
    tables["geometry"]["degree"] = 1
    tables["geometry"]["parameters"] |= {"across": 12, "core": 0, "core_elements": 0}
    system = assemble(make_case(tables))
    mesh = system.bodies.strip.body.mesh
    assert np.ptp(mesh.geometry.x[:, 1]) < 2 * make_case(tables).geometry.parameters["flat_radius"]


def test_a_narrow_margin_of_a_disc_is_meshed() -> None:
    """Elements beside a pad with a margin of 4 mm follow their circles: none is twisted (issue 51, line 24)."""
    tables = tomllib.loads(fill_in(find_template("brake-pad"), ["inner_radius=76.5 mm", "outer_radius=113.5 mm"]))
    tables["geometry"]["degree"] = 1
    tables["geometry"]["parameters"] |= {"margin": 4, "along": 4, "across": 4}
    assemble(make_case(tables), heat="none")


def test_a_track_has_the_capacity_of_its_material() -> None:
    """An edited material changes the rest of the disc as well (issue 51, line 24): volume times rho c, area times h."""
    tables = tomllib.loads(fill_in(find_template("brake-pad")))
    tables["geometry"]["degree"] = 1
    tables["geometry"]["parameters"] |= {"along": 2, "across": 2, "pad_layers": 1, "disc_layers": 1}
    track = make_case(tables).heat.track
    for capacity in ("500 J/(kg*K)", "900 J/(kg*K)"):
        tables["materials"]["iron"]["heat_capacity"] = capacity
        case = make_case(tables)
        heat = assemble(case, heat="reduced").bodies.heat[1]
        stored, lost = heat.bulk(case.heat.track)
        assert stored == pytest.approx(7.2e-6 * 1e3 * float(capacity.split()[0]) * track.volume, rel=1e-6)
        assert lost == pytest.approx(0.05 * track.area)
    for wrong in ({}, {"volume": "1 mm^3", "heat_capacity": "1 J/K"}):
        with pytest.raises(CaseError, match="either volume or heat_capacity"):
            make_case({**tables, "heat": {**tables["heat"], "track": wrong}})


def test_crossed_cylinders_touch_in_hertz_ellipse() -> None:
    """Of radii 5 and 10 mm under 100 N: largest pressure, and the half-axes by the pressure's second moments.

    Reference: Johnson, Contact Mechanics, 4.24 to 4.28, with e the ellipse's eccentricity and a its longer half-axis.
    """
    tables = tomllib.loads(fill_in(find_template("crossed-cylinders"), ["load=100 N", "contact_width=0.6 mm"]))
    tables["geometry"]["degree"], tables["contact"]["friction"] = 1, 0
    tables["geometry"]["parameters"] |= {"core": 0, "across": 10}
    system = assemble(make_case(tables))
    pressure = next(iter(march(system, 1))).pressure[0]
    modulus, curvatures = 210e3 / (1 - 0.3**2) / 2, (1 / 20, 1 / 10)

    def ratio(m: float) -> float:
        return float((ellipe(m) / (1 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)))

    m = brentq(lambda m: ratio(m) - curvatures[1] / curvatures[0], 1e-6, 1 - 1e-6)
    a = (3 * 100 / (2 * np.pi * modulus * curvatures[0] * m) * (ellipk(m) - ellipe(m))) ** (1 / 3)
    b = a * np.sqrt(1 - m)
    assert pressure.max() == pytest.approx(3 * 100 / (2 * np.pi * a * b), rel=0.04)
    carried = pressure * system.pair.weights
    for along, half_axis in ((0, b), (1, a)):
        assert np.sqrt(5 * np.average(system.pair.punch.x[:, along] ** 2, weights=carried)) == pytest.approx(
            half_axis, rel=0.04
        )


def test_friction_heats_a_pin() -> None:
    """With the heat of its last lines, and where nodes in contact alone conduct, a pin keeps all heat (line 24)."""
    text = fill_in(find_template("pin-on-disc"))
    tables = tomllib.loads(re.sub(r"^# (\[heat\]|convection =|track =)", r"\1", text, flags=re.MULTILINE))
    tables["geometry"]["degree"] = 1
    case = make_case(tables)
    assert case.heat.conducting == "closed"
    (block,) = march(assemble(case), 2)
    assert block.pressure.min() > 0
    assert block.heat.balance_error.max() < 1e-9
    assert block.heat.largest_temperature[-1] > block.heat.largest_temperature[0] > 0
