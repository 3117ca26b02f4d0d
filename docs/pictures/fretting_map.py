"""Draws docs/static/case-fretting-map.png, the regime over amplitude and load.

python3 docs/pictures/fretting_map.py
"""

from __future__ import annotations

from pathlib import Path

from fenwear import load_case, sweep
from fenwear.studies.sweep_picture import sweep_figure

STATIC = Path(__file__).resolve().parents[1] / "static"
SETTINGS = ("contact.law=coulomb", "run.half_cycles=2", "geometry.parameters.elements_along_contact=16")
OVER = {"motion.amplitude": "0.5um,1um,2um,4um,8um", "punch.loads.0.force.1": "-40,-60,-80"}


def main() -> None:
    """Compute the map of 15 variants and draw its regimes."""
    variants = sweep(load_case("fretting-partial-slip", list(SETTINGS)), OVER, of="run")
    sweep_figure(variants[["regime", "trouble"]]).savefig(STATIC / "case-fretting-map.png", dpi=150)


if __name__ == "__main__":
    main()
