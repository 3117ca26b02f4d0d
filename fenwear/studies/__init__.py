"""One run into its folder (`run`), and studies of many runs: sweeps, sensitivities, calibration, life with scatter.

From Python:

    from fenwear import load_case
    from fenwear.studies import calibrate, lifetime, read_data, sensitivity

    case = load_case("case.toml")
    fit = calibrate(case, [read_data("profile.csv", case)], ["wear.punch.coefficient"])
    life = lifetime(case, "depth 0.2 mm", fit.scatter())

The runs of all studies are computed and kept by `study`. A sweep has its keys and their values in `sweep_plan`, the
results of one variant in `variant`, those of all in `sweep_dataset`.
"""

from fenwear.studies.calibrate import Calibration, between, calibrate, calibrate_each
from fenwear.studies.least_squares import LeastSquares
from fenwear.studies.lifetime import Lifetime, lifetime
from fenwear.studies.measured_data import DataSet, Noise, Series, measured_folder, read_data
from fenwear.studies.model import Model, Snapshot
from fenwear.studies.numeric_keys import Unknown
from fenwear.studies.quantities import Quantity, evaluate, parse_quantity
from fenwear.studies.scatter import Scatter, load_scatter, parse_scatter
from fenwear.studies.sensitivity import Forward, Sensitivity, forward, sensitivity
from fenwear.studies.study import StudyOptions
from fenwear.studies.sweep import sweep
from fenwear.studies.sweep_plan import Axis, make_axis, parse_axis, read_table

__all__ = [
    "Axis",
    "Calibration",
    "DataSet",
    "Forward",
    "LeastSquares",
    "Lifetime",
    "Model",
    "Noise",
    "Quantity",
    "Scatter",
    "Sensitivity",
    "Series",
    "Snapshot",
    "StudyOptions",
    "Unknown",
    "between",
    "calibrate",
    "calibrate_each",
    "evaluate",
    "forward",
    "lifetime",
    "load_scatter",
    "make_axis",
    "measured_folder",
    "parse_axis",
    "parse_quantity",
    "parse_scatter",
    "read_data",
    "read_table",
    "sensitivity",
    "sweep",
]
