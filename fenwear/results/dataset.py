"""The blocks of a run as one dataset, with the names, units and words of history.nc."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray

from fenwear.cycle import Block
from fenwear.errors import CaseError, InputError
from fenwear.results.degrees import KELVIN, degrees_of
from fenwear.results.history import columns_of, rows_of, variables_of
from fenwear.results.scar import conforming


def to_dataset(blocks: Block | Iterable[Block]) -> xarray.Dataset:
    """Return all half-cycles of blocks as a dataset, as `read_history` returns those of a run.

    Args:
        blocks: One, or those that `march`, `jump` or `evolve` yield, in their order.

    Raises:
        CaseError: there is no block.
    """
    found = [blocks] if isinstance(blocks, Block) else list(blocks)
    if not found:
        raise CaseError(InputError("blocks", "expected at least one: no half-cycle was computed"))
    system = found[0].system
    variables, degrees = variables_of(system), degrees_of(system.case)
    parts = [rows_of(block, variables) for block in found]
    data = {name: (c.dimensions, c.values, dict(c.attributes)) for name, c in columns_of(system).items()}
    for name, (dimensions, unit, text) in variables.items():
        values = np.concatenate([part[name] for part in parts])
        if unit == KELVIN.unit:
            values, unit = degrees.of(values), degrees.unit  # noqa: PLW2901
        data[name] = (dimensions, values, {"units": unit, "long_name": text})
    attributes = {"title": system.case.title or "fenwear run", "conforming": int(conforming(system.pair))}
    if system.case.model.kind != "plane":
        attributes["model"] = system.case.model.kind
    return xarray.Dataset(data, attrs=attributes).set_coords([name for name in data if name in ("x", "half_cycle")])
