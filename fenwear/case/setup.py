"""The table of the set-up: by which ranks the bodies are condensed onto the contact."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from fenwear.case.quantities import Part


class Setup(Part):
    """By which ranks the bodies are condensed onto the contact; results agree on any of them."""

    reproducible: bool = Field(
        default=False,
        description="results equal to the last bit on any number of ranks: each body is on one, so that two work",
    )

    def problems(self, heat: Literal["reduced", "full"] | None) -> list[str]:
        """Return what of it does not go together.

        Args:
            heat: The operator of the heat; None without.
        """
        found = []
        if self.reproducible and heat == "full":
            found.append("setup.reproducible: expected heat.operator = 'reduced', whose steps every rank makes alike")
        return found
