"""The numerical uncertainty of a run's numbers as a table: each number, what it may be off by, and what of."""

from __future__ import annotations

from typing import Any, NamedTuple

from fenwear.report.key_numbers import flat, number_text
from fenwear.results.sheet import LINES, OF_CONTACT, UNCERTAINTY, shown

NO_NUMBERS = ("contributions", "untold", "remedies", "seconds")
SMALL = 0.01  # of an uncertainty: shares that are left out


class UncertainNumber(NamedTuple):
    """A line of the table: in words, in the units in which the numbers are read."""

    label: str
    unit: str
    value: str
    uncertainty: str
    sources: str


def uncertainty_rows(summary: dict[str, Any]) -> list[UncertainNumber]:
    """Return a line for each number of a summary whose uncertainty it tells; none where it tells of none."""
    found = summary.get(UNCERTAINTY, {})
    sources = {source: flat(own) for source, own in found.get("contributions", {}).items()}
    numbers, lines, rows = flat(summary), {**LINES, **OF_CONTACT}, []
    for path, number in flat({key: value for key, value in found.items() if key not in NO_NUMBERS}).items():
        of, _, key = path.rpartition(".")
        line = lines[key]
        parts = sorted(((own.get(path, 0.0), source) for source, own in sources.items()), reverse=True)
        made_of = [
            f"{source.replace('_', ' ')} {100 * part / number:.0f} %"
            for part, source in parts
            if number and part > SMALL * number
        ]
        value, within = (number_text(shown(one, line)) for one in (numbers[path], float(f"{number:.1e}")))
        label = f"{line.label}, {of}" if of else line.label
        rows.append(UncertainNumber(label, line.unit, value, within, ", ".join(made_of)))
    return rows
