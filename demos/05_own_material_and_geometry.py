# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # 5. Your own material and geometry
#
# A friction pad slides back and forth on a cast-iron rail. It has a soft lining with slanted sides below a steel
# back, and a guide at its right side holds it. Nothing of it is built in. You write the geometry for gmsh, the
# materials and the case, all from Python, and run it.

# %%
# %matplotlib inline
import math
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray
from matplotlib.collections import PolyCollection

from fenwear import CaseError, assemble, make_case, steady
from fenwear.common.compat import geometry_dofmap
from fenwear.results.stored_history import read_history
from fenwear.steps import growth_rate
from fenwear.studies.run import run_case

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements
temporary = tempfile.TemporaryDirectory()
folder = Path(temporary.name)

# %% [markdown]
# ## The geometry
#
# fenwear reads a gmsh `.geo` (or a ready `.msh`). The names of its **physical groups** connect it with the case. Each
# starts with the body it belongs to, `punch_` or `strip_`:
#
# | group | kind | here |
# | --- | --- | --- |
# | regions of material, at least one for each body | surfaces | `punch_lining`, `punch_back`, `strip_rail` |
# | the surfaces that meet | curves | `punch_contact`, `strip_contact` (these names are fixed) |
# | places of loads, supports, held temperatures | curves or points | `punch_top`, `punch_guide`, `strip_foot` |
#
# Nodes of the two contact curves should lie opposite each other: give both the same `Transfinite` spacing. With heat
# the rail really moves under the pad, so that `strip_contact` reaches an amplitude beyond the pad on each side. Put the
# lengths you want to vary into `DefineConstant`: then the case can set them.

# %%
GEOMETRY = """
DefineConstant[
  width = 40,       // of the contact, mm
  slant = 6,        // how much wider the lining is at its top, on each side
  lining = 10,      // height of the lining
  back = 8,         // height of the steel back
  reach = 5,        // how far the rail's contact surface goes beyond the lining: the amplitude
  count = 20        // elements along the contact
];
rail_length = 160;
rail_height = 30;
a = width / 2;
b = a + slant;
size = width / count;

// The pad, above z = 0
Point(1) = {-a, 0, 0};           Point(2) = {a, 0, 0};
Point(3) = {b, lining, 0};       Point(4) = {-b, lining, 0};
Point(5) = {b, lining + back, 0};  Point(6) = {-b, lining + back, 0};
Line(1) = {1, 2};  Line(2) = {2, 3};  Line(3) = {3, 4};  Line(4) = {4, 1};
Line(5) = {3, 5};  Line(6) = {5, 6};  Line(7) = {6, 4};
Curve Loop(1) = {1, 2, 3, 4};    Plane Surface(1) = {1};
Curve Loop(2) = {5, 6, 7, -3};   Plane Surface(2) = {2};

// The rail, below z = 0: points and lines of its own, also at the contact
Point(11) = {-rail_length / 2, 0, 0};  Point(12) = {-a, 0, 0};
Point(13) = {a, 0, 0};                 Point(14) = {rail_length / 2, 0, 0};
Point(17) = {-a - reach, 0, 0};        Point(18) = {a + reach, 0, 0};
Point(15) = {rail_length / 2, -rail_height, 0};
Point(16) = {-rail_length / 2, -rail_height, 0};
Line(11) = {11, 17};  Line(17) = {17, 12};  Line(12) = {12, 13};  Line(18) = {13, 18};
Line(13) = {18, 14};  Line(14) = {14, 15};  Line(15) = {15, 16};  Line(16) = {16, 11};
Curve Loop(3) = {11, 17, 12, 18, 13:16};  Plane Surface(3) = {3};

// Finest at the contact; nodes of the two contact lines opposite each other
Transfinite Curve{1, 12} = count + 1 Using Bump 0.25;
MeshSize{3, 4, 5, 6} = 2 * size;
MeshSize{11, 14, 15, 16} = 6 * size;
MeshSize{1, 2, 12, 13, 17, 18} = size;

Physical Surface("punch_lining") = {1};
Physical Surface("punch_back") = {2};
Physical Curve("punch_contact") = {1};
Physical Curve("punch_top") = {6};
Physical Curve("punch_guide") = {5};
Physical Surface("strip_rail") = {3};
Physical Curve("strip_contact") = {17, 12, 18};
Physical Curve("strip_foot") = {15};
"""
(folder / "pad.geo").write_text(GEOMETRY, "utf-8")
print(f"{len(GEOMETRY.splitlines())} lines written")

# %% [markdown]
# ## The materials
#
# With heat a material needs six values. Numbers may carry any fitting unit. The lining's values are made up, in the
# range of organic friction materials; take measured values for your work.

# %%
materials = {
    "lining": {
        "young": "3 GPa",
        "poisson": 0.25,
        "conductivity": "1.5 W/(m K)",
        "heat_capacity": "1000 J/(kg K)",
        "density": "2200 kg/m^3",
        "expansion": "1.5e-5 1/K",
    },
    "steel": {
        "young": "210 GPa",
        "poisson": 0.3,
        "conductivity": "50 W/(m K)",
        "heat_capacity": "460 J/(kg K)",
        "density": "7850 kg/m^3",
        "expansion": "1.2e-5 1/K",
    },
    "cast_iron": {
        "young": "110 GPa",
        "poisson": 0.26,
        "conductivity": "48 W/(m K)",
        "heat_capacity": "500 J/(kg K)",
        "density": "7200 kg/m^3",
        "expansion": "1.1e-5 1/K",
    },
}

# %% [markdown]
# The share of the friction heat that goes into the pad is an input. A common estimate (Charron) takes the effusivities
# $e = \sqrt{k \rho c}$ of the two bodies:
#
# $$ \kappa = \frac{e_1}{e_1 + e_2} . $$
#
# It holds for two large bodies at equal temperature of their surfaces. Treat it as a start, and vary it.

# %%
effusivity = {"lining": math.sqrt(1.5 * 2200 * 1000), "cast_iron": math.sqrt(48 * 7200 * 500)}
kappa = effusivity["lining"] / sum(effusivity.values())
print(f"kappa = {kappa:.3f}")

# %% [markdown]
# ## The case
#
# A dictionary with the same tables as a case file. `make_case` checks it: unknown keys, wrong units and impossible
# values are all named at once.

# %%
tables = {
    "title": "A friction pad on a cast-iron rail",
    "geometry": {"file": "pad.geo", "degree": 2, "parameters": {"count": 6 if COARSE else 20}},
    "model": {"plane": "strain", "thickness": "50 mm"},
    "materials": materials,
    "punch": {
        "regions": {"punch_lining": "lining", "punch_back": "steel"},
        "supports": [{"on": "punch_guide", "fix": ["x"]}],
        "loads": [{"on": "punch_top", "force": ["0 N", "-4 kN"]}],
    },
    "strip": {
        "regions": {"strip_rail": "cast_iron"},
        "supports": [{"on": "strip_foot", "fix": ["x", "z"]}],
        "temperatures": [{"on": "strip_foot", "temperature": "0 K"}],
    },
    "contact": {"friction": 0.35},
    "wear": {"punch": {"coefficient": "2e-6 1/MPa"}},
    "motion": {"kind": "reciprocating", "amplitude": "5 mm", "angular_frequency": "8 rad/s"},
    "heat": {"partition": kappa, "conductance": "2000 W/(m^2 K)", "convection": "20 W/(m^2 K)"},
    "run": {"half_cycles": 40 if COARSE else 4000, "integration": "implicit"},
}
case = make_case(tables, folder)

# %% [markdown]
# A mistake looks like this:

# %%
wrong = {**tables, "contact": {"friktion": 0.35}, "model": {"plane": "strain", "thickness": "50 kg"}}
try:
    make_case(wrong, folder)
except CaseError as error:
    print(error)

# %% [markdown]
# ## The mesh
#
# Always look at it before you run.

# %%
system = assemble(case)
colours = {"punch_lining": "#E69F00", "punch_back": "#56B4E9", "strip_rail": "0.8"}
figure, ax = plt.subplots(figsize=(7.5, 3.4), layout="constrained")
for body in (system.bodies.punch.body, system.bodies.strip.body):
    points, corners = body.mesh.geometry.x[:, :2], geometry_dofmap(body.mesh)
    for region, tag in body.regions.items():
        cells = corners[body.cell_tags.find(tag)]
        ax.add_collection(PolyCollection(points[cells], facecolor=colours[region], edgecolor="0.3", linewidth=0.4))
        ax.plot([], [], "s", color=colours[region], label=region)
ax.plot(system.pair.x, 0 * system.pair.x, color="#D55E00", linewidth=2, label="contact")
ax.set(aspect="equal", xlim=(-82, 82), ylim=(-32, 22), xlabel="x (mm)", ylabel="z (mm)")
figure.legend(loc="outside upper center", ncols=4, frameon=False)
plt.show()
print(f"{len(system.pair.x)} contact nodes, mean pressure {system.rigid.mean_pressure:.2f} MPa")

# %% [markdown]
# ## Steady state first
#
# It takes a moment and shows what to expect: pressures, temperatures, and whether a run will settle there.

# %%
state = steady(system)
rate = growth_rate(system, state)
print(f"largest pressure {state.pressure.max():.2f} MPa, twice the mean is {2 * system.rigid.mean_pressure:.2f} MPa")
print(f"largest temperature: lining {state.heat.punch.max():.1f} K, rail {state.heat.strip.max():.1f} K")
print(f"growth rate {rate:+.2g} 1/s: {'stable' if rate < 0 else 'unstable'}")

# %% [markdown]
# ## The run
#
# The lining is soft and wears fast. Here `run.integration = "implicit"` is the safe choice, for it is stable with any
# wear in one half-cycle. `fenwear check` and `run` report when explicit steps would be too long.

# %%
summary, run_folder = run_case(case, "pad", folder / "run", print)
history = read_history(run_folder)

# %%
BLUE, RED = "#0072B2", "#D55E00"
x = history.x
figure, axes = plt.subplots(2, 1, figsize=(7, 6), sharex=True, layout="constrained")
for d, colour, name in ((1, BLUE, "rightward"), (-1, RED, "leftward")):
    one_way = history.isel(half_cycle=np.flatnonzero(history.direction.values == d))
    axes[0].plot(x, one_way.pressure[0], ":", color=colour, label=f"{name}, first")
    axes[0].plot(x, one_way.pressure[-1], color=colour, label=f"{name}, last")
    axes[0].plot(
        x, state.pressure[state.directions.index(d)], "k--", linewidth=1, label=None if d > 0 else "steady state"
    )
axes[0].set(ylabel="pressure (MPa)", title="Contact pressure")
axes[0].set_ylim(0, 3 * system.rigid.mean_pressure)
axes[0].legend(frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
axes[1].plot(x, 1000 * (history.wear[-1] - history.wear[-1].min()), color="0", label="run")
axes[1].plot(x, 1000 * (state.shape - state.shape.min()), "--", color="#56B4E9", label="steady state")
axes[1].set(ylabel="depth above the least (µm)", xlabel="position along the contact x (mm)", title="Worn shape")
axes[1].legend(frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
for ax in axes:
    ax.spines[["top", "right"]].set_visible(False)
plt.show()

# %% [markdown]
# ## Temperature in both bodies
#
# At the end of the last half-cycle. The rail takes nearly nine tenths of the friction heat and passes it on to its foot,
# which is held at 0 K. The lining gets little heat and conducts badly: it is hottest at the contact.

# %%
fields = xarray.open_dataset(next((run_folder / "fields").glob("*.nc")), engine="h5netcdf").load()
figure, ax = plt.subplots(figsize=(7.5, 3.2), layout="constrained")
highest = math.ceil(float(fields.punch_temperature.max()))
levels = np.linspace(0, highest, 2 * highest + 1)
for body in ("punch", "strip"):
    corners = fields[f"{body}_cells"].values  # of small elements, the last corner of a triangle twice
    points = np.column_stack([fields[f"{body}_x"], fields[f"{body}_z"]])
    drawn = ax.tricontourf(*points.T, corners[:, :3], fields[f"{body}_temperature"].values, levels, cmap="inferno")
ax.set(aspect="equal", xlim=(-82, 82), ylim=(-32, 22), xlabel="x (mm)", ylabel="z (mm)")
figure.colorbar(drawn, label="temperature (K)", shrink=0.8, ticks=range(highest + 1))
plt.show()

# %% [markdown]
# ## Keep it
#
# The case as a file, which runs from the command line too:

# %%
print(case.to_toml()[:600], "...")

# %% [markdown]
# `(folder / "pad.toml").write_text(case.to_toml())` keeps it; then `fenwear run pad.toml`. The path of the geometry is
# the whole path on this machine. Shorten it to `pad.geo` if you move both files.
#
# ## What to mind
#
# - The contact may be curved, but its smallest gap at the start is at most 1 % of its length. The punch's contact must
#   lie within the strip's; with heat wherever the stroke takes it.
# - Wear is an offset of the gap until it reaches `geometry.follow_wear` of the elements' height; then the meshes follow it.
# - One region may have several surfaces, but all of one element type: triangles or quadrilaterals.
# - A corner of the lining at the contact makes the first pressures depend on the mesh. They wear off.

# %%
temporary.cleanup()
