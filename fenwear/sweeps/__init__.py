"""Many variants of a case: keys over their values, computed side by side, in one dataset.

plan: keys and their values, every variant's case. variant: the results of one. dataset: all of them. sweep, picture:
the function and the command. The runs are computed and kept as of all studies, by `fenwear.life.study`.
"""

from fenwear.sweeps.plan import Axis, make_axis, parse_axis, read_table
from fenwear.sweeps.sweep import sweep

__all__ = ["Axis", "make_axis", "parse_axis", "read_table", "sweep"]
