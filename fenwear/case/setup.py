"""The table of the set-up: how the bodies are condensed onto the contact, and by which ranks."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from fenwear.case.quantities import Part

Way = Literal["automatic", "substructures", "elimination", "columns", "low-rank", "multigrid"]
OF_TEMPERATURES: tuple[Way, ...] = (
    "automatic",
    "columns",
    "low-rank",
    "multigrid",
)  # give displacements of whole bodies


class Setup(Part):
    """How the bodies are condensed onto the contact, and by which ranks; results agree whatever is chosen."""

    way: Way = Field(
        default="automatic",
        description="by the size of the factor and the memory, told by check; substructures: every rank eliminates "
        "its own cells; elimination: each body on a rank of its own, down to its surface; columns: a factor, and a "
        "solution for each column of forces; low-rank: the columns by a compressed factor over all ranks, refined; "
        "multigrid: the columns by conjugate gradients, without a factor",
    )
    reproducible: bool = Field(
        default=False,
        description="results equal to the last bit on any number of ranks: each body is on one, so that two work",
    )

    def problems(self, heat: Literal["reduced", "full"] | None, contact: Literal["condensed", "full"]) -> list[str]:
        """Return what of it does not go together.

        Args:
            heat: The operator of the heat; None without.
            contact: What the contact is solved with.
        """
        found = []
        if heat is not None and self.way not in OF_TEMPERATURES:
            names = ", ".join(f"'{way}'" for way in OF_TEMPERATURES)
            found.append(f"setup.way: expected one of {names} with heat: temperatures act inside the bodies")
        if self.reproducible and self.way in ("substructures", "low-rank", "multigrid"):
            found.append(f"setup.reproducible: expected another way than '{self.way}', whose sums go over the ranks")
        if self.reproducible and contact == "full":
            found.append("setup.reproducible: expected contact.solver = 'condensed', whose sums stay on a rank")
        if self.reproducible and heat == "full":
            found.append("setup.reproducible: expected heat.operator = 'reduced', whose steps every rank makes alike")
        return found
