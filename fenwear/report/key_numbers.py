"""The key numbers of a run with their uncertainty, and whether its end is stationary: for screen and report."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from fenwear.case.body_names import Names, by_roles
from fenwear.common.errors import CaseError, InputError, readable
from fenwear.results.history import CASE, SUMMARY
from fenwear.results.sheet import LINES, OF_CONTACT, UNCERTAINTY, Line, shown
from fenwear.results.stored_history import in_current_names

UNITS = {
    "_per_s": "1/s",
    "_MPa": "MPa",
    "_mm2": "mm²",
    "_mm3": "mm³",
    "_mm": "mm",
    "_K": "K",
    "_degC": "°C",
    "_deg": "degrees",
    "_mJ": "mJ",
    "_seconds": "s",
}
ALL_LINES = LINES | OF_CONTACT
NO_NUMBERS = ("contributions", "untold", "remedies", "seconds")  # of the table of uncertainties
SMALL = 0.01  # of an uncertainty: shares that are left out
ANSWERS = ("worn_volume_mm3", "largest_depth_", "largest_pressure_MPa", "largest_pressure_in_cycle", "mean_pressure",
           "largest_temperature_")  # fmt: skip
SHOWN_FIRST = ("worn_volume_mm3", "largest_depth_mm", "largest_pressure_MPa", "mean_pressure_MPa",
               "largest_temperature_")  # fmt: skip
STATIONARY = 1e-3  # change in a cycle below which pressures repeat
LEAST = 1e-3  # %: pressures that repeat better are not known better
CERTAIN, BELOW = 1e-3, "below 0.1 %"  # of a number: uncertainties that are not given as a number
# What is no line of the sheet, which has words for the others.
LABELS = {
    "half_cycles": "half-cycles done",
    "stop": "how the run stopped",
    "setup_seconds": "time for meshes and operators",
    "half_cycles_seconds": "time for the half-cycles",
    **{f"largest_pressure_at_{axis}_mm": f"where the pressure is largest, {axis}" for axis in "rxyz"},
    "pressure_beside_largest_MPa": "mean pressure of the nodes beside it",
    "nodes_across_contact": "nodes across the contact",
    "nodes_along_sliding": "nodes across the contact, along the sliding",
    "nodes_across_sliding": "nodes across the contact, across the sliding",
    "largest_temperature_of_run_half_cycle": "half-cycle in which it was largest",
    "heat_mJ": "heat of the last half-cycle",
    "heat_steps": "time steps of the heat in each half-cycle, the fewest of all stages",
    "heat_change_by_halving_steps": "largest change of contact temperatures by halving them, relative",
    "heat_difference_from_whole_mesh": "largest difference of contact temperatures and thermal gap from the whole "
    "mesh's, relative",
    "heat_gain": "thermoelastic feedback: largest rise of a pressure by its friction heat of a half-cycle, over it; "
    "from 1 on the contact may have several solutions",
    "wear_step_over_explicit_limit": "wear of a half-cycle over the limit of explicit steps",
    "growth_rate_per_s": "growth rate of disturbances of the final state; below 0 they die out",
    "largest_complementarity_error": "largest error of p >= 0, gap >= 0 and p gap = 0, over their scales",
    "largest_equilibrium_error": "largest error of the force and moment balance, over the load",
    "largest_heat_balance_error": "largest error of the heat balance, over its largest term",
    "ranks": "MPI ranks",
}


def read_summary(directory: Path) -> dict[str, Any]:
    """Return summary.json of a run, empty where it has not ended.

    Raises:
        CaseError: it cannot be read.
    """
    path = directory / SUMMARY
    try:
        summary = in_current_names(path.read_text("utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise CaseError(InputError(str(path), f"no readable summary of a run: {error}")) from None
    if not isinstance(summary, dict):
        raise CaseError(InputError(str(path), "no summary of a run"))
    return summary


def names_in(directory: Path) -> Names:
    """Return the names of the bodies in the case of a run.

    Raises:
        CaseError: it cannot be read.
    """
    return Names.of(read_case(directory))


def read_case(directory: Path) -> dict[str, Any]:
    """Return the tables of the resolved case of a run, by the bodies' roles.

    Raises:
        CaseError: it cannot be read.
    """
    path = directory / CASE
    try:
        return by_roles(tomllib.loads(path.read_text("utf-8")))
    except OSError as error:
        message = f"{error.strerror}; expected the folder of a run"
        raise CaseError(InputError(str(path), message)) from None
    except ValueError as error:
        raise CaseError(InputError(str(path), f"no readable case of a run: {error}")) from None


def flat(tables: Any, prefix: str = "") -> dict[str, Any]:
    """Return every single value by its path, such as heat_mJ.friction or wear_mm[1]."""
    if isinstance(tables, Mapping):
        pairs = [(f"{prefix}.{key}" if prefix else str(key), value) for key, value in tables.items()]
    elif isinstance(tables, list):
        pairs = [(f"{prefix}[{number}]", value) for number, value in enumerate(tables)]
    else:
        return {prefix: tables}
    return {path: value for key, inner in pairs for path, value in flat(inner, key).items()}


def line_of(path: str) -> Line:
    """Return the words and the unit of a number by its path in a summary: those of the sheet where that has it."""
    names = path.split(".")
    units = (unit for name in names for end, unit in UNITS.items() if name.partition("[")[0].endswith(end))
    plain = Line(", ".join(map(words_of, names)), next(units, ""))
    return ALL_LINES.get(path) or ALL_LINES.get(names[-1], plain)


def number_text(value: Any, digits: int = 5) -> str:
    """Return a value as people read it: in some digits, a dash where there is no number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "–" if value is None else str(value)
    if isinstance(value, int):
        return f"{value:,}"
    if not math.isfinite(value):
        return "–" if math.isnan(value) else f"{value}"
    return readable(value, digits).replace("-", "−")


class Number(NamedTuple):
    """A number of the report.

    Attributes:
        path: In summary.json.
        value: There.
        label: In words.
        unit: In which it is read.
        text: Its text.
        uncertainty: As text, "± 0.05" or that it is small; "" where it is not known.
        sources: Largest sources of the uncertainty.
    """

    path: str
    value: float
    label: str
    unit: str
    text: str
    uncertainty: str = ""
    sources: str = ""

    @classmethod
    def of(cls, path: str, value: float, key: str) -> Number:
        """Return a number as it is read, in the words of a key."""
        line = line_of(key)
        return cls(path, value, line.label, line.unit, number_text(shown(value, line)))


def answers(summary: Mapping[str, Any]) -> list[Number]:
    """Return the main results of a run, with uncertainties: wear and its place, pressures, temperatures."""
    given = summary.get(UNCERTAINTY, {})
    numbers, sources = (
        flat(summary),
        {source: flat(contribution) for source, contribution in given.get("contributions", {}).items()},
    )
    uncertain = flat({key: value for key, value in given.items() if key not in NO_NUMBERS})
    rows = []
    for path, value in numbers.items():
        of, _, key = path.rpartition(".")
        if path.startswith((UNCERTAINTY, "contacts.")) or not key.startswith(ANSWERS) or key not in ALL_LINES:
            continue
        within = uncertain.get(path, 0.0)
        parts = sorted(
            ((contribution.get(path, 0.0), source) for source, contribution in sources.items()), reverse=True
        )
        most = [f"{s.replace('_', ' ')} {100 * part / within:.0f} %" for part, s in parts if part > SMALL * within > 0]
        line, digits, text = ALL_LINES[key], 5, ""
        if within and value:
            digits = min(max(2 + math.floor(math.log10(abs(value) / within)), 2), 5)
            text = BELOW if within < CERTAIN * abs(value) else f"± {number_text(shown(float(f'{within:.1e}'), line))}"
        label, read = f"{words_of(key)}, {of}" if of else words_of(key), number_text(shown(value, line), digits)
        rows.append(Number(path, value, label, line.unit, read, text, ", ".join(most)))
    return rows


def states(summary: Mapping[str, Any]) -> list[str]:
    """Return whether the end of a run is stationary, and whether it is stable, in sentences; none without a summary."""
    change, rate = summary.get("periodicity", math.nan), summary.get("growth_rate_per_s", math.nan)
    if not summary:
        return []
    if change is None or math.isnan(change):
        stationary = "Stationary: not known."
    elif change < STATIONARY:
        within = readable(max(100 * change, LEAST))
        stationary = f"Stationary: pressures repeat in each cycle, to {within} % of the pressure scale."
    else:
        stationary = f"Not stationary: pressures change by {readable(100 * change)} % of the pressure scale in a cycle."
    if rate is not None and math.isfinite(rate):
        grows = f"Unstable: small disturbances of the final contact grow, e-fold in {1 / max(rate, 1e-300):.3g} s"
        decays = f"Stable: small disturbances of the final contact decay, to 1/e in {1 / max(-rate, 1e-300):.3g} s"
        return [stationary, f"{grows if rate > 0 else decays} (growth rate {number_text(rate)} 1/s)."]
    if "heat_mJ" not in summary:
        return [stationary]
    return [stationary, f"Stability not assessed: {summary.get('no_growth_rate') or 'not computed for this run'}."]


def first_screen(summary: Mapping[str, Any], directory: Path) -> str:
    """Return the end of a run as lines for people: the largest number of each kind, its state, warnings and files."""
    rows, given = answers(summary), summary.get(UNCERTAINTY, {})
    named = [(row.path.rpartition(".")[2], row) for row in rows if row.unit]
    kinds = [[row for key, row in named if key.startswith(start)] for start in SHOWN_FIRST]
    first = [max(kind, key=lambda row: row.value) for kind in kinds if kind]
    wide = max((len(row.label) for row in first), default=0)
    lines = [f"{summary['half_cycles']:,} half-cycles: {summary['stop']}"]
    for row in first:
        number = f"{row.text} {row.unit} (uncertainty {BELOW})"
        if row.uncertainty != BELOW:
            number = " ".join(part for part in (row.text, row.uncertainty, row.unit) if part)
        lines.append(f"  {row.label:{wide}}  {number}")
    lines += [f"Uncertainty from the {s.replace('_', ' ')}: {why}" for s, why in given.get("untold", {}).items()]
    if any(row.uncertainty for row in first):
        lines += [f"To lower the uncertainty: {'; '.join(sorted(set(given['remedies'].values())))}"]
    lines += states(summary)
    if count := len(summary["warnings"]):
        lines.append(f"Warnings: {count}, see above and in the report.")
    report = directory / "report.html"
    lines.append((f"Report: {report}. " if report.exists() else "") + f"All numbers: fenwear sheet {directory}")
    return "\n".join(lines)


def words_of(name: str) -> str:
    """Return a name in words, as the sheet has it where that is a sentence of its own."""
    bare, bracket, index = name.partition("[")
    words = LABELS.get(bare)
    if words is None:
        line = ALL_LINES.get(bare)
        stem = bare.removesuffix(next((suffix for suffix in UNITS if bare.endswith(suffix)), ""))
        words = stem.replace("_", " ") if line is None or line.label.startswith(("...", "at ")) else line.label
    return words + bracket + index
