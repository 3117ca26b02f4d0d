"""A sample of the fuzzing, and what it has found."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import cases

from fenwear import CaseError, System, make_case


@pytest.mark.parametrize(("task", "count"), [(cases.try_case, 300), (cases.try_mesh, 20)])
def test_sample(task: Any, count: int) -> None:
    """Mutated cases and meshes are computed or refused with words; both happens."""
    kinds, defects = cases.fuzz(task, count, first=1_000_000)
    assert not defects
    assert kinds["ok"] + kinds["refused"] == count
    assert min(kinds["ok"], kinds["refused"]) > 0


def test_the_fuzzer_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is no use if it cannot fail: units that are converted wrongly."""
    units = [seed for seed in range(200) if (unit := cases.mutated(seed)[1]) is not None and unit[1] is not None]
    monkeypatch.setattr("fenwear.case.schema.convert", lambda value, unit: 1.0)
    assert any(cases.try_case(seed)[0] == "wrong" for seed in units)


def test_crash_and_hang_are_told() -> None:
    """Of processes that die and that do not end."""
    from pool import verdicts

    found = {v.seed: v.kind for v in verdicts(misbehave, range(4), workers=2, seconds=5)}
    assert found == {0: "ok", 1: "crash", 2: "hang", 3: "traceback"}


def misbehave(seed: int) -> tuple[str, str]:
    import os
    import signal
    import time

    if seed == 1:
        os.kill(os.getpid(), signal.SIGSEGV)
    if seed == 2:
        time.sleep(1000)
    if seed == 3:
        raise ZeroDivisionError
    return "ok", ""


def changed(**tables: Any) -> dict[str, Any]:
    import copy

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
    "out of the plane": (lambda x, e: ([*x[:2], x[0]], e), "it is not plane"),
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
        System(make_case(cases.mesh_tables(), tmp_path))


def test_doubled_element(tmp_path: Path) -> None:
    """The same element twice."""
    lines = list(cases.mesh_lines())
    rows = cases.element_rows(lines)
    lines[rows[3]] = f"{lines[rows[3]].split()[0]} {lines[rows[4]].split(' ', 1)[1]}"
    (tmp_path / "own.msh").write_text("\n".join(lines) + "\n")
    with pytest.raises(CaseError, match="there twice"):
        System(make_case(cases.mesh_tables(), tmp_path))
