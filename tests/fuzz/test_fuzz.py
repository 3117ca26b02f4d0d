"""A sample of the fuzzing, and what it has found."""

from __future__ import annotations

import copy
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import bases
import cases

from fenwear import CaseError, assemble, make_case
from fenwear.case.dependence import VARIABLES, evaluate, parse_expression
from fenwear.common.errors import FenwearError, InputError


@pytest.mark.process
@pytest.mark.parametrize(("task", "count"), [(cases.try_case, 60), (cases.try_mesh, 10)])
def test_sample(task: Any, count: int) -> None:
    """Mutated cases and meshes are computed or refused with words; both happens."""
    kinds, defects = cases.fuzz(task, count, first=1_000_000)
    assert not defects
    assert kinds["ok"] + kinds["refused"] == count
    assert min(kinds["ok"], kinds["refused"]) > 0


def test_the_fuzzer_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is no use if it cannot fail: units that are converted wrongly."""
    units = [seed for seed in range(200) if (unit := cases.mutated(seed)[1]) is not None and unit[1] is not None]
    monkeypatch.setattr("fenwear.case.table_parts.convert", lambda value, unit: 1.0)
    assert any(cases.try_case(seed)[0] == "wrong" for seed in units)


def test_messages_speak_no_python() -> None:
    """Of many mutated cases, as far as their validation."""
    said = []
    for seed in range(2_000_000, 2_000_700):
        try:
            make_case(cases.mutated(seed)[0])
        except CaseError as error:
            said.append(cases.said(error))
    assert len(said) > 200
    assert not [text for text in said if text.startswith("BAD")]


@pytest.mark.parametrize(
    "text",
    [
        *("heat.conductance.function-after[functools.partial(<function f at 0x7f>)]: expected 0", "model: got None"),
        *("x: a valid dictionary or instance of Model", "y: tuple should have 1 item", "z: np.float64(1.0)"),
        *(
            "a: <class 'float'>",
            "b: Traceback (most recent call last)",
            "c: at <object object at 0x7f>",
            "d: KeyError: 1",
        ),
    ],
)
def test_python_is_noticed(text: str) -> None:
    """What the test above looks for is found."""
    key, _, message = text.partition(": ")
    assert cases.said(CaseError(InputError(key, message))).startswith("BAD")
    assert not cases.said(CaseError(InputError("contact.friction", f"got {text!r}"))).startswith("BAD")  # quoted only


@pytest.mark.process
def test_crash_and_hang_are_told() -> None:
    """Of processes that die, that compute for ever and that wait for ever."""
    from pool import verdicts

    found = {v.seed: v.kind for v in verdicts(misbehave, range(4), workers=2, seconds=2)}
    assert found == {0: "ok", 1: "crash", 2: "hang", 3: "traceback"}
    (waits,) = verdicts(misbehave, range(4, 5), workers=1, seconds=2, patience=2)
    assert waits.kind == "hang"


def misbehave(seed: int) -> tuple[str, str]:
    import os
    import signal
    import time

    if seed == 1:
        os.kill(os.getpid(), signal.SIGSEGV)
    while seed == 2:
        pass
    while seed == 4:
        time.sleep(1000)
    if seed == 3:
        raise ZeroDivisionError
    return "ok", ""


def changed(**tables: Any) -> dict[str, Any]:
    return {**copy.deepcopy(cases.base("example1")), **tables}


def test_an_integer_beyond_all_floats() -> None:
    """It was an OverflowError."""
    with pytest.raises(CaseError, match=r"contact.friction: .*finite"):
        make_case(changed(contact={"friction": 10**400}))


def test_long_texts_are_shortened() -> None:
    """A message repeated what it refused, all 100,000 characters of it."""
    with pytest.raises(CaseError) as refused:
        make_case(changed(contact={"friction": "x" * 100_000, "y" * 100_000: 1}))
    assert all(len(line) < 1100 for line in str(refused.value).splitlines())
    assert "100,0" in str(refused.value)


# What it did before: a traceback of linprog or of an eigenvalue solver, a crash of dolfinx, or no end.
BAD_MESHES = {
    "NaN": (lambda x, e: (["nan", *x[1:]], e), "coordinates that are no numbers"),
    "out of the plane": (lambda x, e: ([*x[:2], x[0]], e), "in no plane"),
    "twisted": (lambda x, e: (x, [e[0], e[2], e[1], e[3]]), "degenerate or twisted"),
    "two corners": (lambda x, e: (x, [e[0], e[1], e[0], e[1]]), "degenerate or twisted"),
    "corner twice": (lambda x, e: (x, [e[0], e[0], e[2], e[3]]), "degenerate or twisted"),
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_mesh(tmp_path: Path, name: str) -> None:
    """One bad node or element is refused in words."""
    change, expected = BAD_MESHES[name]
    lines = list(cases.mesh_lines())
    node, element = cases.node_rows(lines)[20], cases.element_rows(lines)[5]
    number, *corners = lines[element].split()
    coordinates, corners = change(lines[node].split(), corners)
    lines[node], lines[element] = " ".join(coordinates), " ".join((number, *corners))
    (tmp_path / "own.msh").write_text("\n".join(lines) + "\n")
    with pytest.raises(CaseError, match=expected):
        assemble(make_case(cases.mesh_tables(), tmp_path))


def test_doubled_element(tmp_path: Path) -> None:
    """The same element twice."""
    lines = list(cases.mesh_lines())
    rows = cases.element_rows(lines)
    lines[rows[3]] = f"{lines[rows[3]].split()[0]} {lines[rows[4]].split(' ', 1)[1]}"
    (tmp_path / "own.msh").write_text("\n".join(lines) + "\n")
    with pytest.raises(CaseError, match="there twice"):
        assemble(make_case(cases.mesh_tables(), tmp_path))


# ------------------------------------------------------------------- laws, motions, loads


@pytest.mark.parametrize("text", bases.HOSTILE)
def test_expressions_compute_or_are_refused(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever it says, it is arithmetic that ends at once, or refused in words; nothing is run or opened."""
    monkeypatch.chdir(tmp_path)
    seen: list[str] = []
    _watched.append(seen)
    nodes = dict.fromkeys(VARIABLES, np.asarray(10.0)) | {"T": np.zeros(1000), "p": np.linspace(0, 100, 1000)}
    begin = time.process_time()  # of the processor: the same on a busy machine
    message, shape = "", (0,)
    try:
        shape = evaluate(parse_expression(text), nodes, (1000,)).shape
    except ValueError as refused:
        message = str(refused)
    finally:
        _watched.clear()
    assert shape == (1000,) or "expected" in message or "wrong number of arguments" in message
    assert time.process_time() - begin < 10  # some take a millisecond, without limits of ours some take for ever
    assert not [
        event for event in seen if event.startswith(("open", "os.", "subprocess.", "exec", "import", "socket."))
    ]
    assert not list(tmp_path.iterdir())


_watched: list[list[str]] = []
sys.addaudithook(lambda event, _: _watched[0].append(event) if _watched else None)


def test_the_watch_sees(tmp_path: Path) -> None:
    """What the test above would miss if its watch saw nothing."""
    seen: list[str] = []
    _watched.append(seen)
    eval("open(path, 'w').close()", {"path": tmp_path / "made"})
    _watched.clear()
    assert "open" in seen
    assert "exec" in seen


@pytest.mark.parametrize("text", ["9" * 400, "1e400", "p + 1" + "0" * 310])
def test_numbers_in_expressions_are_finite(text: str) -> None:
    """An integer beyond all floats was an OverflowError, and a float infinity."""
    with pytest.raises(CaseError, match="expected finite numbers"):
        make_case(changed(contact={"friction": {"expression": text}}))


def test_friction_has_no_unit() -> None:
    """Of an expression or a table it was accepted, whatever it was, and had no effect."""
    for law in ({"expression": "0.2", "unit": "MPa"}, {"table": [[0, 20], [1, 20]], "unit": "percent"}):
        with pytest.raises(CaseError, match=r"contact.friction.unit:"):
            make_case(changed(contact={"friction": law}))


# What it did before: an error of numpy, of SciPy or of MUMPS without a word of ours, or a result that is none.
BEYOND = {
    "fast": ("hardness", ("motion", "amplitude"), "1e300 mm", "its speed to the power of 1 is beyond all numbers"),
    "dense": ("followed", ("materials", "composite", "density"), 1e300, "has no factor"),
    "conducting": ("followed", ("materials", "composite", "conductivity"), 1e300, "equal to 1000000000000"),
    "hot": ("example2-heat", ("heat", "initial"), 1e300, "are beyond all numbers"),
    "far pivot": ("bushing", ("punch", "pivot"), ["1e300 mm", 0], "the gap overflows"),
    "strained": ("stick carried", ("stick", "bulk_stress"), 1e25, "the strip would be strained by"),
    "above all pressures": ("cap", ("wear", "punch", "pressure_threshold"), 2**63, "and nothing wears"),
    "next to no elements": ("solid", ("geometry", "parameters", "core"), 1e-9, "degenerate or twisted"),
    "coarse bore": ("misaligned", ("geometry", "parameters", "beyond_elements"), 2, "too long for the curve"),
    "finer than rounding": ("example1-heat", ("heat", "reduction_tolerance"), 5e-324, "or equal to 0.0000001"),
}


@pytest.mark.parametrize("name", BEYOND)
def test_numbers_beyond_what_can_be_computed(name: str) -> None:
    """Refused, or ended as a solver that did not converge, in words."""
    base, path, value, expected = BEYOND[name]
    tables = copy.deepcopy(cases.base(base))
    cases.at(tables, path[:-1])[path[-1]] = value
    with pytest.raises(FenwearError, match=expected):
        cases.compute(make_case(tables), end=True)


def test_a_default_in_another_unit() -> None:
    """A pressure that only wear per area has was refused as 1e5 N/m^2, and went as 0.1 MPa, its default."""
    tables = copy.deepcopy(cases.base("example1"))
    tables["wear"]["punch"]["touching_from"] = "100000 N/m^2"
    assert make_case(tables).wear.punch.touching_from == pytest.approx(0.1)


def test_a_stroke_faster_than_numbers_are_large() -> None:
    """Of a table, with a wear rate that follows the square of the speed: an OverflowError."""
    tables = copy.deepcopy(cases.base("exponents"))
    tables["motion"] = {"kind": "table", "times": [0, 1e-300, 1], "displacements": [0, 1e-3, 0]}
    with pytest.raises(CaseError, match="its speed to the power of 2 is beyond all numbers"):
        cases.compute(make_case(tables))


@pytest.mark.parametrize("name", cases.NAMES)
def test_what_the_fuzzing_starts_from(name: str) -> None:
    """Every base computes: without that a mutation shows nothing."""
    cases.compute(make_case(cases.base(name)))
