"""Many variants of a case: keys over their values, computed side by side, in one dataset.

axes: keys and their values. plan: every variant's case, and the pieces that share their set-up. evaluate: what is
computed of one. engines: by this process, local processes or ranks. store: what is kept of each, and the dataset of
all. picture, command: what `fenwear sweep` shows.
"""

from fenwear.sweeps.plan import Axis, make_axis, parse_axis, read_table
from fenwear.sweeps.sweep import sweep

__all__ = ["Axis", "make_axis", "parse_axis", "read_table", "sweep"]
