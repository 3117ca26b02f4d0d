"""What the tests of the room share: small cases, and data made of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import Case, load_case
from fenwear.studies import Model

SMALL = ["geometry.degree=2", "geometry.parameters.elements_along_contact=8"]


@pytest.fixture(scope="session")
def small() -> Callable[..., Case]:
    """Return small(name, *settings): a built-in case on a coarse mesh."""
    return lambda name, *settings: load_case(name, [*SMALL, *settings])


@pytest.fixture
def profile(tmp_path: Path) -> Callable[..., Path]:
    """Return profile(case, cycles, noise, ...): a file with the profile of a run and normal noise (mm)."""

    def profile(
        case: Case, cycles: int, noise: float, *, name: str = "data.csv", seed: int = 0, lines: Sequence[str] = (),
        change: Any = lambda x, depth: depth,
    ) -> Path:  # fmt: skip
        settings = [line.removeprefix("# set ").replace(" = ", "=", 1) for line in lines if line.startswith("# set")]
        end = list(Model(case).run({}, cycles, settings=settings))[-1].end
        places = end.system.pair.x
        depth = change(places, end.wear[-1]) + np.random.default_rng(seed).normal(0, noise, len(places))
        rows = [f"{x!r},{1e3 * d!r}" for x, d in zip(places.tolist(), depth.tolist(), strict=True)]
        path = tmp_path / name
        path.write_text("\n".join([*lines, f"# after = {cycles} cycles", "x (mm),depth (um)", *rows]))
        return path

    return profile
