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
# # 1. A first tour
#
# A punch is pressed on a strip that slides back and forth under it. Friction tilts the punch a little, one way and
# then the other. So the pressure sits at one edge in one half-cycle and at the other edge in the next. Wear removes
# material where pressure is high, and slowly changes the shape of the punch. After many cycles the shape is final:
# the pressures repeat from cycle to cycle.
#
# In this notebook you run this problem, Example 1 of Páczelt and Mróz without heat, and look at its results. It takes
# about ten seconds to compute.
#
# **Units** everywhere: mm, N, s, K, and so MPa for stress. **Coordinates**: x along the contact from the punch's
# centre, z upwards from the strip's bottom.

# %%
# %matplotlib inline
import json
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray

from fenwear import load_case
from fenwear.report.lines import fields_of, lines_figure
from fenwear.report.run_figures import course_figure
from fenwear.results.stored_history import read_history
from fenwear.studies.run import run_case

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements, fewer half-cycles
settings = []
if COARSE:
    settings = [
        "geometry.degree=2",
        "geometry.parameters.elements_along_contact=8",
        "run.half_cycles=200",
        "wear.punch.coefficient=5e-7",  # wears faster, to get as far in fewer half-cycles
    ]

# %% [markdown]
# ## The problem
#
# `load_case` reads a case: a built-in one by its name, or your own TOML file by its path. Every value can be
# overridden with `"key=value"`, here as a second argument, on the command line with `--set`.

# %%
case = load_case("example1", settings)

size = case.geometry.parameters
width, layer, pin = size["punch_width"], size["layer_height"], size["pin_height_1"]
print(case.title)
print(f"contact {width:g} mm wide, {case.model.thickness:g} mm thick, plane {case.model.plane}")
print(f"load {-case.punch.loads[0].force[1] / 1000:g} kN, friction coefficient {case.contact.friction:g}")
print(f"amplitude u0 = {case.motion.amplitude:g} mm, omega = {case.motion.angular_frequency:g} rad/s")
print(f"wear rate = {case.wear.punch.coefficient:.3g} /MPa * pressure * speed")
print(f"{case.run.half_cycles} half-cycles")

# %%
figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
top, foot = size["strip_height"] + size["punch_height"], size["strip_height"]
ax.add_patch(plt.Rectangle((-110, 40), 220, foot - 40, facecolor="0.85", edgecolor="0.3"))
ax.add_patch(plt.Rectangle((-width / 2, foot), width, layer, facecolor="#E69F00", edgecolor="0.3"))
ax.add_patch(plt.Rectangle((-width / 2, foot + layer), width, top - foot - layer, facecolor="0.75", edgecolor="0.3"))
for x in np.linspace(-0.8, 0.8, 5) * width / 2:
    ax.annotate("", (x, top), (x, top + 22), arrowprops={"arrowstyle": "->", "color": "#0072B2"})
ax.text(width / 2 + 6, top + 10, "10 kN, spread evenly", color="#0072B2", va="center")
ax.plot([width / 2], [foot + pin], "o", color="#D55E00")
ax.text(width / 2 + 6, foot + pin, "hinge O: no motion in x; free in z and to tilt", color="#D55E00", va="center")
ax.text(0, foot + 60, "punch\nsteel", ha="center", va="center")
ax.text(0, foot + layer / 2, "composite", ha="center", va="center")
ax.text(-70, 78, "strip, steel", ha="center", va="center")
ax.annotate("", (70, 62), (-70, 62), arrowprops={"arrowstyle": "<->", "color": "0"})
ax.text(0, 52, "slides to and fro, ± 1.5 mm", ha="center", va="center")
ax.set(aspect="equal", xlim=(-112, 150), ylim=(38, 226), xlabel="x (mm)", ylabel="z (mm)")
ax.spines[["top", "right"]].set_visible(False)
ax.set_title("Example 1 (the strip is longer and thicker than shown)", loc="left", fontsize="medium")
plt.show()

# %% [markdown]
# ## The run
#
# `run_case` does what the command `fenwear run example1` does. Everything it leaves is in one folder. Here that is a
# temporary folder; give a path of your own to keep it.

# %%
temporary = tempfile.TemporaryDirectory()
folder = Path(temporary.name) / "first-tour"
summary, folder = run_case(case, "first-tour", folder, print)

for path in sorted(folder.rglob("*")):
    if path.is_file():
        print(path.relative_to(folder))

# %% [markdown]
# `history.nc` holds every half-cycle and is read with xarray. Each variable knows its unit.

# %%
xarray.set_options(display_expand_attrs=False)  # the whole case file is among them
history = read_history(folder)
history

# %%
last = history.isel(half_cycle=-1)
print(
    f"half-cycle {int(last.half_cycle)}: largest pressure {float(last.largest_pressure):.2f} {last.largest_pressure.units}"
)
print(f"width in contact {float(last.contact_width):.1f} {last.contact_width.units}")

# %% [markdown]
# ## Pressure
#
# Look at the edges first. A flat punch on an elastic strip has a high pressure there, and wear rounds the edges off.
# Then compare the two directions. While the strip moves rightward, friction pulls the lower end of the punch to the
# right. This turns the punch about the hinge, and the pressure moves to the left edge. Leftward it is the other way
# round.

# %%
shown = [1, 10, 50, 200] if COARSE else [1, 20, 200, 800, 2600]
fields = fields_of(history)
lines_figure(history, [fields["pressure"]], shown)

# %% [markdown]
# ## Worn shape
#
# The worn depth is in micrometres. Both edges wear more than the middle: each of them carries the high pressure in
# every second half-cycle. In the end the shape only moves down as a whole.

# %%
lines_figure(history, [fields["wear"]], shown)

# %% [markdown]
# ## How far has it come?
#
# The half-cycles are on a logarithmic scale: running-in slows down. The largest pressure falls towards **twice the
# mean**, and there it ends; notebook 2 shows why. This run is on its way to that steady state, but not quite there.
# `steady` gets there at once; `"run.integration=jump"` takes many cycles in one step.

# %%
course_figure(history, "peaks")

# %% [markdown]
# ## Stress in the bodies
#
# The folder `fields` has displacement and stress in both bodies at the last half-cycle. They are a series for
# ParaView, and plain NetCDF of nodes and values, which any plotting library can draw.

# %%
fields = xarray.open_dataset(next((folder / "fields").glob("*.nc")), engine="h5netcdf").load()

figure, ax = plt.subplots(figsize=(7, 3.8), layout="constrained")
levels = np.linspace(0, 60, 13)
for body in ("punch", "strip"):
    quads = fields[f"{body}_cells"].values  # corners around each small quadrilateral
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    x, z = fields[f"{body}_x"].values, fields[f"{body}_z"].values
    drawn = ax.tricontourf(x, z, triangles, fields[f"{body}_von_mises"].values, levels, cmap="cividis", extend="max")
ax.axhline(foot, color="w", linewidth=0.8)
arrow = "rightward →" if fields.direction > 0 else "leftward ←"
ax.set(aspect="equal", xlim=(-75, 75), ylim=(50, 150), xlabel="x (mm)", ylabel="z (mm)")
ax.set_title(f"Half-cycle {fields.half_cycle}, the strip moves {arrow}", loc="left", fontsize="medium")
figure.colorbar(drawn, label="von Mises stress (MPa)")
plt.show()

# %% [markdown]
# The white line is the contact. In this direction the right half carries most of the load. The bright spot above it
# is the hinge, at x = 30 mm and z = 120 mm. It holds a single point, where the stress has no finite value. The number
# there depends on the mesh and means nothing.
#
# ## The key numbers
#
# `summary.json` has them, each with its unit in its name. Two are checks. The first is the balance of forces and
# moments, relative to the load. The second is the periodicity, the change of pressure against one cycle ago over the
# pressure scale.

# %%
keys = ("half_cycles", "stop", "nominal_pressure_MPa", "wear_mm", "rightward", "leftward", "periodicity")
print(json.dumps({key: summary[key] for key in (*keys, "largest_equilibrium_error")}, indent=2))

# %% [markdown]
# ## Your turn
#
# - Change the friction: `load_case("example1", ["contact.friction=0.1"])`.
# - Move the hinge up: `"geometry.parameters.pin_height_1=40"`. The punch tilts more.
# - Take plane strain instead of plane stress: `"model.plane=strain"`.
#
# Next: notebook 2 (the steady state), 3 (heat), 4 (several processes, and resuming a run), 5 (your own material and
# geometry).

# %%
temporary.cleanup()
