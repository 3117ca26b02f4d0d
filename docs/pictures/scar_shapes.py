"""Draws docs/static/scar-shapes.png, scars with debris: python3 docs/pictures/scar_shapes.py."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from fenwear import jump, load_case
from fenwear.system import assemble

STATIC = Path(__file__).resolve().parents[1] / "static"
SETTINGS = (
    "geometry.follow_wear=never",
    "geometry.parameters.contact_width='0.6 mm'",
    "geometry.parameters.elements_along_contact=40",
    "geometry.parameters.overlap='0.3 mm'",
    "contact.law=gross-sliding",
    "motion.amplitude='60 um'",
    "motion.positions=1",
)
PLAIN = "wear={punch={coefficient='5e-8 1/MPa'}}"
AIR = "wear={punch={coefficient={expression='5e-8*(0.1+0.9*exp(-edge/0.03))', unit='1/MPa'}}}"
KEPT = "contact.third_body={share=0.9, life='200 m', edge_life='20 mm', edge_length='20 um'}"
SCARS = {
    "ejected at once": ("0.6", (PLAIN,)),
    "90 % kept, lost at the edges": ("tab:blue", (PLAIN, KEPT)),
    "ejected, wears by its air": ("tab:orange", (AIR,)),
    "90 % kept, wears by its air": ("tab:red", (AIR, KEPT)),
}
SHOWN = (1000, 4000)


def main() -> None:
    """Compute the four scars and draw them."""
    figure = Figure(figsize=(7.2, 3.1), layout="constrained")
    axes = figure.subplots(1, len(SHOWN))
    for colour, settings in SCARS.values():
        system = assemble(load_case("fretting-partial-slip", [*SETTINGS, *settings]))
        for ax, last in zip(axes, SHOWN, strict=True):
            *_, block = jump(system, last, tolerance=3e-3)
            ax.plot(1e3 * system.pair.x, -1e3 * block.wear[-1], color=colour)
    for ax, last in zip(axes, SHOWN, strict=True):
        ax.set(title=f"{last:,} half-cycles", xlabel="x (µm)", xlim=(-220, 220))
    axes[0].set_ylabel("worn depth (µm)")
    figure.legend(axes[0].lines, list(SCARS), loc="outside lower center", ncols=2)
    figure.savefig(STATIC / "scar-shapes.png", dpi=150)


if __name__ == "__main__":
    main()
