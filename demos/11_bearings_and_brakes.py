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
# # 11. Bearings and brakes
#
# Some contacts wrap around the other body, or touch it at several places. Here are a bushing that wears from a line
# contact to half of its bore, and a load that tilts it. A drum brake and a ball that walks in its cup follow. All are
# built-in cases; the answers on paper stand beside them.

# %%
# %matplotlib inline
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray
from scipy.optimize import brentq

from fenwear import load_case
from fenwear.report.lines import fields_of
from fenwear.report.maps import map_figure, tracks_figure
from fenwear.studies.run import run_case

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements
folder = tempfile.TemporaryDirectory()


def run(name, *settings):
    """Run a built-in case; return its history and its summary."""
    case = load_case(name, [*settings, "output.report=false", "output.fields_at=[]"])
    summary, directory = run_case(case, name, Path(folder.name) / name, print, progress="none")
    with xarray.open_dataset(directory / "history.nc", engine="h5netcdf") as history:
        return history.load(), summary


# %% [markdown]
# ## A bushing
#
# A shaft of 20 mm turns in its bronze bushing under 1 kN, with 0.1 mm of play. The bushing is free to move: pressure and
# friction together carry the load. A tester of roundness would see the bore like this, its wear fifty times as deep as it
# is.

# %%
elements = 80 if COARSE else 160
history, summary = run("bushing", f"geometry.parameters.elements_along_contact={elements}", "run.half_cycles=1000000")
x, z = history.place.values, history.height.values + 0.05  # from the bore's middle
psi, radius = np.arctan2(x, z), 10.05

fig, ax = plt.subplots(figsize=(5.5, 5.5), layout="constrained", subplot_kw={"projection": "polar"})
ax.set_theta_zero_location("N")
ax.set_theta_direction(-1)
for turns in (1e3, 1e4, 1e5, 1e6):
    n = int(np.abs(history.half_cycle.values - turns).argmin())
    ax.plot(psi, radius + 50 * history.wear[n], label=f"{int(history.half_cycle[n]):,} turns")
ax.set_ylim(0, None)
ax.set_yticks([radius], ["bore"])
ax.legend(loc="lower center", frameon=False)
plt.show()

# %% [markdown]
# For rigid bodies the worn arc has a half angle $\psi_0$ by $k P s / (R D) = \psi_0 / \cos\psi_0 - \sin\psi_0$. The
# bore is $D (\cos\psi / \cos\psi_0 - 1)$ deep. D is the radial play, P the load per length, and s the sliding
# distance. Friction turns it all by atan mu. The elastic bushing reaches this when its wear exceeds its elastic
# deflection.

# %%
load, clearance, wear = 1000 / 20, 0.05, 1e-9
slid = history.sliding_distance.values * load * wear / (10.0 * clearance)
arcs = np.array([brentq(lambda a, s=s: a / np.cos(a) - np.sin(a) - s, 0, np.pi / 2 - 1e-6) for s in slid])

fig, axes = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
axes[0].loglog(history.half_cycle, 1e3 * history.largest_depth, label="fenwear")
axes[0].loglog(history.half_cycle, 1e3 * clearance * (1 / np.cos(arcs) - 1), "k:", label="rigid bodies")
axes[0].set(xlabel="turns", ylabel="largest worn depth (µm)", ylim=(1e-2, None))
axes[0].legend(frameon=False)
axes[1].semilogx(history.half_cycle, 1e3 * history.eccentricity, label="fenwear")
axes[1].semilogx(history.half_cycle, 1e3 * clearance / np.cos(arcs), "k:", label="rigid bodies: D / cos psi0")
axes[1].set(xlabel="turns", ylabel="eccentricity of the shaft (µm)", ylim=(0, None))
axes[1].legend(frameon=False)
plt.show()
angle = float(history.attitude_angle[-1])
print(f"attitude angle at the end {angle:.2f} degrees, -atan mu {-np.degrees(np.arctan(0.15)):.2f}")
print(f"worn volume over k F s {float(history.worn_volume[-1] / (wear * 1000 * history.sliding_distance[-1])):.4f}")

# %% [markdown]
# The shaft wears, too, a twentieth as fast; but evenly, all the way round.
#
# ## A load off the middle
#
# The solid has the load 3 mm beside the middle of a bushing of 20 mm. The bushing tilts on its shaft, until the
# contact carries the load where it acts. The bore is unrolled, its top in the middle.

# %%
small = ["geometry.parameters.fine_elements=12", "geometry.parameters.along=4"] if COARSE else []
tilted, _ = run("bushing-misaligned", *small)
chosen = [int(n) for n in tilted.half_cycle.values[[0, len(tilted.half_cycle) // 2, -1]]]
map_figure(tilted, fields_of(tilted)["pressure"], chosen)

# %%
fig, ax = plt.subplots(figsize=(6.5, 3), layout="constrained")
ax.semilogx(tilted.half_cycle, 1e3 * tilted.turned_x, label="about x, across the load")
ax.semilogx(tilted.half_cycle, 1e3 * tilted.turned_z, label="about z, along it")
ax.set(xlabel="turns", ylabel="tilt of the bushing (mrad)")
ax.legend(frameon=False)
plt.show()

# %% [markdown]
# ## A drum brake
#
# Two shoes, hinged below, are pressed apart by the same force above. Worn in, the pressure of a rigid shoe is $p_a
# \sin\theta$ with $\theta$ the angle from its hinge (Shigley). Friction presses the leading shoe on and the trailing
# shoe off.

# %%
along = f"geometry.parameters.elements_along_lining={24 if COARSE else 48}"
drum, summary = run("drum-brake", "run.half_cycles=200000", along)
theta = np.degrees(np.abs(np.arctan2(drum.place.values, -drum.height.values))) - 24.06

fig, ax = plt.subplots(figsize=(6.5, 3.5), layout="constrained")
for name, number in zip(drum.contact.attrs["flag_meanings"].split(), drum.contact.attrs["flag_values"], strict=True):
    own = drum.contact.values == number
    colour = {"right": "C0", "left": "C1"}[name]
    for n, style in ((0, ":"), (-1, "-")):
        label = f"{'leading' if name == 'right' else 'trailing'}, turn {int(drum.half_cycle[n]):,}"
        ax.plot(theta[own], drum.pressure[n][own], style, color=colour, label=label)
    largest = float((drum.pressure[-1][own] / np.sin(np.radians(theta[own]))).mean())
    ax.plot(theta[own], largest * np.sin(np.radians(theta[own])), "k--", linewidth=0.8)
ax.set(xlabel="angle from the hinge (degrees)", ylabel="pressure (MPa)", ylim=(0, None))
ax.legend(frameon=False)
plt.show()
shoes = {name: sheet["punch"]["worn_volume_mm3"] for name, sheet in summary["contacts"].items()}
print({name: f"{volume:.0f} mm³" for name, volume in shoes.items()})

# %% [markdown]
# ## A ball in a cup
#
# A made cycle of walking has three turns and a load whose direction changes, in 32 steps. Each place of the cup is
# rubbed along a track of its own, most of it forwards and backwards. Where tracks are wide, rubbing also acts across
# the main direction, along which the molecules were drawn out. Polyethylene wears faster there.

# %%
small = ["geometry.parameters.across=4", "geometry.parameters.around=3"] if COARSE else []
cup, summary = run("ball-in-cup", "run.half_cycles=100", "run.jump_tolerance=0.1", *small)
tracks_figure(cup)

# %%
map_figure(cup, fields_of(cup)["wear"], [int(cup.half_cycle[-1])])

# %%
print(f"worn per million cycles {summary['punch']['worn_volume_per_million_cycles_mm3']:.1f} mm³")
print(f"cross-shear ratio, mean over the work of friction {summary['punch']['mean_cross_shear']:.3f}")
