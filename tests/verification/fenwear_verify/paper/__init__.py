"""Every number of the paper beside fenwear's: computed anew, with a verdict on each and its reason."""

from fenwear_verify.paper.figures import Picture, paper_figures
from fenwear_verify.paper.readings import READINGS, Reading
from fenwear_verify.paper.rows import Row, Verdict, paper_rows, sensitivity_rows
from fenwear_verify.paper.section import write_section
from fenwear_verify.paper.states import BRIEF, FULL, Scope

__all__ = [
    "BRIEF",
    "FULL",
    "READINGS",
    "Picture",
    "Reading",
    "Row",
    "Scope",
    "Verdict",
    "paper_figures",
    "paper_rows",
    "sensitivity_rows",
    "write_section",
]
