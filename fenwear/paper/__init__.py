"""Every number of the paper beside fenwear's: computed anew, with a verdict on each and its reason."""

from fenwear.paper.figures import Picture, paper_figures
from fenwear.paper.rows import Row, Verdict, needed_shares, paper_rows, sensitivity_rows
from fenwear.paper.section import write_section
from fenwear.paper.study import FULL, Scope

__all__ = [
    "FULL",
    "Picture",
    "Row",
    "Scope",
    "Verdict",
    "needed_shares",
    "paper_figures",
    "paper_rows",
    "sensitivity_rows",
    "write_section",
]
