"""Runs with their reports, each made once."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import pytest

from fenwear import load_case
from fenwear.studies.run import run_case

EVIL = '<script>alert("1")</script> & <img src=x onerror=alert(1)>'
SMALL = ("geometry.degree=1", "geometry.parameters.elements_along_contact=4", "wear.punch.coefficient=4e-7")
CASES = ("example1", "example1-heat", "monotonic-lz20")


@pytest.fixture(scope="session")
def evil() -> str:
    """Return the title of the runs."""
    return EVIL


@pytest.fixture(scope="session")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return reported(name): the folder of 20 half-cycles of a built-in case; not to be changed."""

    @lru_cache
    def reported(name: str) -> Path:
        case = load_case(name, [*SMALL, "run.half_cycles=20", f"title={json.dumps(EVIL)}"])
        return run_case(case, "run", tmp_path_factory.mktemp("reported") / "run", lambda message: None)[1]

    return reported


@pytest.fixture(scope="module", params=CASES)
def folder(
    request: pytest.FixtureRequest, reported: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Return a copy of such a folder, of the module's own."""
    return shutil.copytree(reported(request.param), tmp_path_factory.mktemp("copy") / "run")
