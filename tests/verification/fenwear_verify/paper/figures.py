"""The pictures of the comparison: each answers one question about a row of the table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fenwear.common.arrays import Array
from fenwear.report.style import (
    ALONG_CONTACT,
    BLUE,
    COLOURS,
    DIRECTIONS,
    GREY,
    contact_axis,
    legend_beside,
    panels,
    reference_line,
    run_style,
)
from fenwear_verify.paper.published import (
    LARGEST_PRESSURE,
    MONOTONIC_TEMPERATURE,
    PEAK_HALF_CYCLE,
    PERIODIC_TEMPERATURE,
    TEMPERATURE_HALF_CYCLE,
)
from fenwear_verify.paper.rows import sensitivity_rows
from fenwear_verify.paper.states import FULL, HeatRun, Scope, Variant
from fenwear_verify.paper.study import central_runs, heat_runs, no_heat, stability_maps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHAPES_AT = (1, 100, 300, 1000, 1800, 2600)
GROWTH = 0.02  # 1/s at which the colours of the map end


class Picture(NamedTuple):
    """A figure with its title and what it shows."""

    title: str
    caption: str
    figure: Figure


def paper_figures(scope: Scope = FULL) -> list[Picture]:
    """Return the pictures of the comparison; collective, four minutes for the full scope at first use."""
    runs = heat_runs(scope)
    choices, discretisations = sensitivity_rows(scope)
    return [
        Picture(
            "Without heat",
            "Contact pressure of the state that repeats from cycle to cycle. The mean of both directions is uniform, "
            f"so that where one of them vanishes the other is twice the mean, {LARGEST_PRESSURE} MPa (dotted).",
            _without_heat(scope),
        ),
        Picture(
            "What the two temperatures ask for, and what is stable",
            "Growth of disturbances of the periodic state of Example 1 over the conductance and the punch's share of "
            f"the friction heat. On the dashed line the one-way motions give {MONOTONIC_TEMPERATURE} K, on the "
            f"dash-dotted one the periodic state has {PERIODIC_TEMPERATURE} K; where they meet, both fit. Above the "
            "black line this state is unstable. Where the faces convect, the punch needs twice the heat, and the lines "
            "run where disturbances grow fast.",
            _map(scope),
        ),
        Picture(
            "Example 1: runs from the cold, flat punch",
            "Largest pressure on the middle two thirds, width in contact and temperature at x = 0, of rightward "
            f"half-cycles. Dotted: the paper's temperatures, and n = {PEAK_HALF_CYCLE:,}, after which its largest "
            "pressure falls.",
            _runs(runs[: len(COLOURS)]),
        ),
        Picture(
            "Example 1: worn shape",
            "Worn depth after several half-cycles, where the contact stays whole and where it splits.",
            _shapes(runs),
        ),
        Picture(
            "Example 2: pressure at the centre",
            f"Mean of both directions at x = 0 over the half-cycles. The paper: about {LARGEST_PRESSURE} MPa (dotted).",
            _central([run for run in central_runs(scope) if run is not None][: len(COLOURS)]),
        ),
        Picture(
            "What else the paper leaves open",
            "Each point is one other choice, all else as in the built-in case, after "
            f"{scope.variants} half-cycles; the dotted lines pass through the built-in case of each example.",
            _variants(choices),
        ),
        Picture(
            "Mesh, time step and coupling",
            "The same numbers on other meshes, with other time steps of heat and other couplings, for Example 1; the "
            "dotted lines pass through the last of each.",
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


def _map(scope: Scope) -> Figure:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import TwoSlopeNorm
    from matplotlib.figure import Figure

    maps, norm = stability_maps(scope), TwoSlopeNorm(0.0, -GROWTH, GROWTH)
    figure = Figure(figsize=(9.0, 3.9), layout="constrained")
    axes: list[Axes] = list(figure.subplots(1, len(maps), sharex=True, sharey=True))
    for ax, one in zip(axes, maps, strict=True):
        ax.contourf(one.conductance, one.share, np.clip(one.growth.T, -GROWTH, GROWTH),
                    levels=np.linspace(-GROWTH, GROWTH, 25), cmap="RdBu_r", norm=norm)  # fmt: skip
        ax.plot(one.conductance, one.neutral, color="black", linewidth=2, label="neutral stability")
        ax.plot(one.conductance, one.one_way, color="black", linestyle="--", linewidth=1.2,
                label=f"one-way motions {MONOTONIC_TEMPERATURE} K")  # fmt: skip
        ax.plot(one.conductance, one.periodic, color="black", linestyle="-.", linewidth=1.2,
                label=f"periodic state {PERIODIC_TEMPERATURE} K")  # fmt: skip
        for reading in scope.readings:
            if reading.point is not None and (reading.faces, reading.debris) == (one.faces, one.debris):
                ax.plot(*reading.point, "o", color="black", markerfacecolor="white", zorder=3)
                left = reading.point[0] < one.conductance[-1] / 2
                ax.annotate(reading.name, reading.point, xytext=(8 if left else -8, -12), textcoords="offset points",
                            ha="left" if left else "right", fontsize="small", in_layout=False)  # fmt: skip
        ax.set(title=one.name, xlabel="conductance h_c (W/(m² K))", xlim=(one.conductance[0], one.conductance[-1]),
               ylim=(one.share[0], one.share[-1]))  # fmt: skip
        ax.title.set_fontsize("small")
    axes[0].set_ylabel("kappa (1 - gamma_d) (-)")
    figure.colorbar(ScalarMappable(norm, "RdBu_r"), ax=axes, label="growth (1/s)", extend="both")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def _runs(runs: Sequence[HeatRun]) -> Figure:
    figure, axes = panels(3, 2.6)
    quantities: tuple[tuple[str, Callable[[HeatRun], Array]], ...] = (
        ("pressure (MPa)", lambda run: run.middle_pressure),
        ("width (mm)", lambda run: run.width),
        ("temperature (K)", lambda run: run.temperature[:, run.centre]),
    )
    for ax, (label, value) in zip(axes, quantities, strict=True):
        for number, run in enumerate(runs):
            shown = run.half_cycle <= len(run.half_cycle)
            ax.plot(run.half_cycle[shown][::2], value(run)[shown][::2], linewidth=1, label=run.reading.name,
                    **run_style(number))  # fmt: skip
        ax.axvline(PEAK_HALF_CYCLE, color="0.5", linewidth=0.8, linestyle=":", label="_paper")
        ax.set(ylabel=label)
        ax.set_ylim(bottom=0)
    reference_line(axes[2], float(MONOTONIC_TEMPERATURE), "")
    reference_line(axes[2], float(PERIODIC_TEMPERATURE), "")
    axes[0].set_title("Largest pressure on the middle two thirds")
    axes[1].set_title("Width in contact")
    axes[2].set_title("Temperature at x = 0")
    axes[2].set_xlabel("n")
    _legend_below(figure, axes[0])
    return figure


def _shapes(runs: Sequence[HeatRun]) -> Figure:
    split = [run for run in runs if run.opened is not None]
    shown = [runs[0], *split[:1]]
    figure, axes = panels(len(shown), 2.6)
    for ax, run in zip(axes, shown, strict=True):
        for number, half_cycle in enumerate(SHAPES_AT):
            ax.plot(run.x, 1e3 * run.wear[run.at(half_cycle)], label=f"{half_cycle:,}", **run_style(number))
        ax.set(title=run.reading.name, ylabel="worn depth (µm)")
        ax.invert_yaxis()
    legend_beside(axes[0], "half-cycle")
    axes[-1].set_xlabel(ALONG_CONTACT)
    return figure


def _central(runs: Sequence[HeatRun]) -> Figure:
    figure, (ax,) = panels(1, 3.4)
    for number, run in enumerate(runs):
        ax.plot(run.half_cycle[1:], run.central_pressure, linewidth=1, label=run.reading.name, **run_style(number))
    reference_line(ax, float(LARGEST_PRESSURE), "paper", at=0.85)
    ax.set(xlabel="n", ylabel="pressure (MPa)", xlim=(0, TEMPERATURE_HALF_CYCLE))
    ax.set_ylim(bottom=0)
    _legend_below(figure, ax)
    return figure


def _legend_below(figure: Figure, ax: Axes) -> None:
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)


def _variants(variants: Sequence[Variant], reference: int = 0) -> Figure:
    """Draw what a choice changes: a row for each, a panel for each quantity."""
    from matplotlib.figure import Figure

    quantities: tuple[tuple[str, Callable[[Variant], float]], ...] = (
        ("temperature\nat the end (K)", lambda v: v.late),
        ("growth\n(1/s)", lambda v: v.steady.growth),
        ("narrowest\ncontact (mm)", lambda v: v.narrowest),
        ("pressure in the\nmiddle (MPa)", lambda v: v.peak),
    )
    figure = Figure(figsize=(9.0, 0.28 * len(variants) + 1.4), layout="constrained")
    axes: list[Axes] = list(figure.subplots(1, len(quantities), sharey=True))
    for ax, (title, value) in zip(axes, quantities, strict=True):
        ax.plot([value(v) for v in variants], range(len(variants)), "o", color=BLUE, markersize=4)
        for group in dict.fromkeys(v.group for v in variants):
            levels = [level for level, v in enumerate(variants) if v.group == group]
            ax.vlines(value(variants[levels[reference]]), levels[0] - 0.4, levels[-1] + 0.4, color=BLUE,
                      linestyle=":", linewidth=1)  # fmt: skip
        ax.set_title(title, fontsize="small")
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize="small")
    axes[0].set_yticks(range(len(variants)), [v.name for v in variants])
    axes[0].invert_yaxis()
    return figure
