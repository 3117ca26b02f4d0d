"""From a measurement to a life: quantities of interest, sensitivities, calibration, life with scatter.

From Python:

    from fenwear import load_case
    from fenwear.life import calibrate, lifetime, read_data, sensitivity

    case = load_case("case.toml")
    fit = calibrate(case, [read_data("profile.csv", case)], ["wear.punch.coefficient"])
    life = lifetime(case, "depth 0.2 mm", fit.scatter())
"""

from fenwear.life.calibrate import Calibration, between, calibrate, calibrate_each
from fenwear.life.data import DataSet, Noise, Series, measured_folder, read_data
from fenwear.life.keys import Unknown
from fenwear.life.least_squares import LeastSquares
from fenwear.life.lifetime import Lifetime, lifetime
from fenwear.life.model import Model, Snapshot
from fenwear.life.quantities import Quantity, evaluate, parse_quantity
from fenwear.life.scatter import Scatter, load_scatter, parse_scatter
from fenwear.life.sensitivity import Forward, Sensitivity, forward, sensitivity
from fenwear.life.study import StudyOptions

__all__ = [
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
    "measured_folder",
    "parse_quantity",
    "parse_scatter",
    "read_data",
    "sensitivity",
]
