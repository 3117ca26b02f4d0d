"""The pictures of the comparison: each answers one question about a row of the table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from fenwear.arrays import Array
from fenwear.paper.published import (
    DIFFERENCE,
    LARGEST_PRESSURE,
    MONOTONIC_TEMPERATURE,
    PEAK_HALF_CYCLE,
    PERIODIC_TEMPERATURE,
)
from fenwear.paper.rows import NEUTRAL, needed_shares, sensitivity_rows
from fenwear.paper.study import FULL, HeatRun, Scope, Variant, heat_runs, no_heat
from fenwear.report.style import (
    ALONG_CONTACT,
    BLUE,
    DIRECTIONS,
    GREY,
    RED,
    contact_axis,
    legend_beside,
    panels,
    reference_line,
    run_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KAPPA = "kappa, the punch's share of the friction heat (-)"
SHAPES_AT = (1, 100, 300, 1000, 1800, 2600)


class Picture(NamedTuple):
    """A figure with its title and what it shows."""

    title: str
    caption: str
    figure: Figure


def paper_figures(scope: Scope = FULL) -> list[Picture]:
    """Return the pictures of the comparison; collective, three minutes for the full scope at first use."""
    one, two = heat_runs("example1-heat", scope), heat_runs("example2-heat", scope)
    choices, discretisations = sensitivity_rows(scope)
    return [
        Picture(
            "Without heat",
            "Contact pressure of the state that repeats from cycle to cycle. The mean of both directions is uniform, "
            f"so that where one of them vanishes the other is twice the mean, {LARGEST_PRESSURE} MPa (dotted).",
            _without_heat(scope),
        ),
        Picture(
            "Temperature and stability over kappa",
            "Temperature at x = 0 of Example 1 from the two one-way motions and in periodic motion, how far they are "
            "apart, and the rate at which disturbances of the periodic state grow. Dotted: the paper.",
            _over_share(one),
        ),
        Picture(
            "Which kappa each number needs",
            "Were one kappa behind all of the paper's numbers, the points would stand on one vertical line. Left of "
            "the grey area the periodic state of Example 1 is stable in our model; in it no run stays there.",
            _needed(scope),
        ),
        Picture(
            "Example 1: runs from the cold, flat punch",
            f"Largest pressure in the middle third, width in contact and temperature at x = 0. The paper's pressure "
            f"grows until half-cycle {PEAK_HALF_CYCLE:,} and then falls (dotted).",
            _runs(one),
        ),
        Picture(
            "Example 1: worn shape",
            "Worn depth after several half-cycles, for a stable and an unstable kappa.",
            _shapes(one),
        ),
        Picture(
            "Example 2: pressure at the centre",
            f"Mean of both directions at x = 0 over the half-cycles. The paper: about {LARGEST_PRESSURE} MPa (dotted).",
            _central(two),
        ),
        Picture(
            "What the paper leaves open",
            "Each line is one other choice, at two values of kappa; the dotted lines pass through the built-in case "
            "of each example.",
            _variants(choices),
        ),
        Picture(
            "Mesh and time step",
            "The same numbers on other meshes and with other time steps of heat, for Example 1; the dotted lines pass "
            "through the finest of each.",
            _variants(discretisations, reference=-1),
        ),
    ]


def _without_heat(scope: Scope) -> Figure:
    figure, axes = panels(2, 2.4)
    for ax, name, title in zip(axes, ("example1", "example2"), ("Example 1", "Example 2"), strict=True):
        example = no_heat(name, scope)
        for direction, pressure in zip(example.state.directions, example.state.pressure, strict=True):
            way, dash, colour = DIRECTIONS[direction]
            ax.plot(example.x, pressure, color=colour, linestyle=dash, label=way)
        ax.plot(example.x, example.state.pressure.mean(axis=0), color=GREY, linestyle="-.", label="mean of both")
        reference_line(ax, float(LARGEST_PRESSURE), "paper")
        ax.set(title=title, ylabel="pressure (MPa)")
        ax.set_ylim(0, 40)
    legend_beside(axes[0], "strip moves")
    contact_axis(axes[-1])
    return figure


def _over_share(runs: Sequence[HeatRun]) -> Figure:
    figure, axes = panels(3, 2.2)
    shares = [run.share for run in runs]
    one_way, periodic = run_style(0), run_style(1)
    axes[0].plot(shares, [run.steady.monotonic for run in runs], marker="o", label="two one-way motions", **one_way)
    axes[0].plot(shares, [run.steady.periodic for run in runs], marker="s", label="periodic motion", **periodic)
    for printed, colour in ((MONOTONIC_TEMPERATURE, one_way["color"]), (PERIODIC_TEMPERATURE, periodic["color"])):
        axes[0].axhline(float(printed), color=colour, linestyle=":", linewidth=1)
    axes[0].set(ylabel="temperature (K)", title="Temperature at x = 0")
    axes[0].legend(frameon=False)
    axes[1].plot(shares, [run.steady.difference for run in runs], marker="o", **one_way)
    reference_line(axes[1], float(DIFFERENCE), "paper")
    axes[1].set(ylabel="apart (%)", title="Difference over the periodic temperature")
    axes[1].set_ylim(bottom=0)
    axes[2].plot(shares, [run.steady.growth for run in runs], marker="o", **one_way)
    reference_line(axes[2], 0.0, "neutral")
    axes[2].set(ylabel="growth (1/s)", title="Growth of disturbances of the periodic state", xlabel=KAPPA)
    return figure


def _needed(scope: Scope) -> Figure:
    needed = needed_shares(scope)
    neutral = needed.pop(NEUTRAL)
    names = {
        "monotonic temperature": f"{MONOTONIC_TEMPERATURE} K, one-way motions",
        "periodic temperature": f"{PERIODIC_TEMPERATURE} K, periodic motion",
        "their difference": f"{DIFFERENCE} % apart",
        "central pressure, Example 2": f"{LARGEST_PRESSURE} MPa at the centre",
    }
    figure, (ax,) = panels(1, 2.4)
    if neutral is not None:
        ax.axvspan(neutral, max(scope.shares), color="0.9", linewidth=0)
    for level, share in enumerate(needed.values()):
        if share is None:
            ax.annotate("none", (min(scope.shares), level), va="center")
        else:
            ax.plot(share, level, "o", color=BLUE)
            ax.annotate(f"{share:.2f}", (share, level), xytext=(6, 0), textcoords="offset points", va="center")
    ax.set_yticks(range(len(needed)), [names[key] for key in needed])
    ax.set_ylim(len(needed) - 0.5, -0.5)
    ax.set_xlim(min(scope.shares), max(scope.shares))
    ax.set(xlabel=KAPPA)
    return figure


def _runs(runs: Sequence[HeatRun]) -> Figure:
    figure, axes = panels(3, 2.2)
    quantities: tuple[tuple[str, Callable[[HeatRun], Array]], ...] = (
        ("pressure (MPa)", lambda run: run.middle_pressure),
        ("width (mm)", lambda run: run.width),
        ("temperature (K)", lambda run: run.temperature[:, run.centre]),
    )
    for ax, (label, value) in zip(axes, quantities, strict=True):
        for number, run in enumerate(runs):
            ax.plot(run.half_cycle[::2], value(run)[::2], linewidth=1, label=f"{run.share:g}", **run_style(number))
        ax.axvline(PEAK_HALF_CYCLE, color="0.5", linewidth=0.8, linestyle=":", label="_paper")
        ax.set(ylabel=label)
        ax.set_ylim(bottom=0)
    axes[0].set_title("Largest pressure on the middle third, rightward half-cycles")
    axes[1].set_title("Width in contact")
    axes[2].set_title("Temperature at x = 0")
    axes[2].set_xlabel("half-cycle")
    legend_beside(axes[0], "kappa")
    return figure


def _shapes(runs: Sequence[HeatRun]) -> Figure:
    stable = [run for run in runs if run.steady.growth < 0]
    unstable = [run for run in runs if run.steady.growth >= 0]
    shown = [*stable[-1:], *unstable[-1:]]
    figure, axes = panels(len(shown), 2.6)
    for ax, run in zip(axes, shown, strict=True):
        for number, half_cycle in enumerate(n for n in SHAPES_AT if n <= len(run.wear)):
            ax.plot(run.x, 1e3 * run.wear[run.at(half_cycle)], label=f"{half_cycle:,}", **run_style(number))
        ax.set(title=f"kappa = {run.share:g}", ylabel="worn depth (µm)")
        ax.invert_yaxis()
    legend_beside(axes[0], "half-cycle")
    axes[-1].set_xlabel(ALONG_CONTACT)
    return figure


def _central(runs: Sequence[HeatRun]) -> Figure:
    figure, (ax,) = panels(1, 3.0)
    for number, run in enumerate(runs):
        ax.plot(run.half_cycle[1:], run.central_pressure, linewidth=1, label=f"{run.share:g}", **run_style(number))
    reference_line(ax, float(LARGEST_PRESSURE), "paper", at=0.42)  # where no line runs
    ax.set(xlabel="half-cycle", ylabel="pressure (MPa)")
    ax.set_ylim(bottom=0)
    legend_beside(ax, "kappa")
    return figure


def _variants(variants: Sequence[Variant], reference: int = 0) -> Figure:
    """Draw what a choice changes: a row for each, a panel for each quantity."""
    from matplotlib.figure import Figure

    names = list(dict.fromkeys((v.group, v.name) for v in variants))
    shares = list(dict.fromkeys(v.share for v in variants))
    quantities: tuple[tuple[str, Callable[[Variant], float]], ...] = (
        ("periodic\ntemperature (K)", lambda v: v.steady.periodic),
        ("growth\n(1/s)", lambda v: v.steady.growth),
        ("narrowest\ncontact (mm)", lambda v: v.narrowest),
        ("pressure in the\nmiddle (MPa)", lambda v: v.peak),
    )
    figure = Figure(figsize=(9.0, 0.28 * len(names) + 1.4), layout="constrained")
    axes: list[Axes] = list(figure.subplots(1, len(quantities), sharey=True))
    levels = {name: level for level, name in enumerate(names)}
    for ax, (title, value) in zip(axes, quantities, strict=True):
        for share, colour, marker in zip(shares, (BLUE, RED), "os", strict=False):
            rows = [v for v in variants if v.share == share]
            ax.plot([value(v) for v in rows], [levels[v.group, v.name] for v in rows], marker, color=colour,
                    markersize=4, label=f"{share:g}")  # fmt: skip
            for group in dict.fromkeys(v.group for v in rows):
                members = [v for v in rows if v.group == group]
                ends = sorted(levels[v.group, v.name] for v in (members[0], members[-1]))
                ax.vlines(
                    value(members[reference]), ends[0] - 0.4, ends[1] + 0.4, color=colour, linestyle=":", linewidth=1
                )
        ax.set_title(title, fontsize="small")
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize="small")
    axes[0].set_yticks(range(len(names)), [name for _, name in names])
    axes[0].invert_yaxis()
    axes[-1].legend(title="kappa", loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    return figure
