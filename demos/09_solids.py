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
# # 9. Solids and rings
#
# A ring on a ring, a pin on a disc, a ball on a flat: each with its answer on paper beside it. All are built-in cases;
# their results live on the nodes of the contact surface.

# %%
# %matplotlib inline
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray
from IPython import display as screen

from fenwear import assemble, load_case, steady
from fenwear.report.lines import fields_of, lines_figure
from fenwear.report.maps import map_figure
from fenwear.studies.run import run_case

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements
LINEAR = ["geometry.degree=1", "geometry.order=1"] if COARSE else []
folder = tempfile.TemporaryDirectory()


def run(name, *settings):
    """Run a built-in case; return its history and its summary."""
    case = load_case(name, [*settings, "output.report=false", "output.fields_at=[]"])
    summary, directory = run_case(case, name, Path(folder.name) / name, print, progress="none")
    with xarray.open_dataset(directory / "history.nc", engine="h5netcdf") as history:
        return history.load(), summary


# %% [markdown]
# ## A ring on a ring
#
# The model is the cross-section of both rings; x is the radius. The speed at a radius is omega r, so that a pressure
# wears evenly where p r is uniform: in the end $p = F / (2 \pi (r_o - r_i)\, r)$. `run` follows the way there, `steady`
# goes to the end at once.

# %%
history, summary = run("ring-on-ring", f"run.half_cycles={200 if COARSE else 5000}", "geometry.parameters.across=6")
state = steady(assemble(load_case("ring-on-ring", ["geometry.parameters.across=6"])))
exact = 2000 / (2 * np.pi * 10 * history.r)

fig, ax = plt.subplots(figsize=(6.5, 3.5), layout="constrained")
for n in (0, len(history.half_cycle) // 2, -1):
    ax.plot(history.r, history.pressure[n], label=f"after {int(history.half_cycle[n]):,} turns")
ax.plot(history.r, state.pressure[0], "k.", label="steady")
ax.plot(history.r, exact, "k:", label="F / (2 pi (ro - ri) r)")
ax.set(xlabel="radius r (mm)", ylabel="pressure (MPa)", ylim=(0, 2))
ax.legend(frameon=False)
plt.show()
print(f"largest difference of the steady state: {np.abs(state.pressure[0] / exact.values - 1).max():.1e}")
volume = 5e-9 * (history.pressure * history.weight * history.r).sum("node") * 2 * np.pi
print(
    f"volume worn in the last turn {float(history.worn_volume_increment[-1]):.6g} mm³, by hand {float(volume[-1]):.6g} mm³"
)

# %% [markdown]
# ## The same rings, hot
#
# Friction heats both, and their surfaces swell in the middle of their width: in the first turn they touch in a part of it
# only. The heat spreads, wear takes off what has swollen, and the end is the same as without heat: $p r$ is uniform,
# whatever the temperature.

# %%
settings = ["geometry.parameters.across=6", *(["geometry.degree=2"] if COARSE else [])]
hot, _ = run("ring-on-ring-heat", f"run.half_cycles={20 if COARSE else 20000}", *settings)

fig, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
turns = hot.half_cycle.values
for n in sorted({int(np.searchsorted(turns, min(turn, turns[-1]))) for turn in (1, 100, 2000, 8000, 20000)}):
    left.plot(hot.r, hot.pressure[n], label=f"after {int(turns[n]):,} turns")
    right.plot(hot.r, hot.temperature_punch[n])
even = 2000 / (2 * np.pi * 10 * hot.r)
left.plot(hot.r, even, "k:", label="F / (2 pi (ro - ri) r)")
left.set(xlabel="radius r (mm)", ylabel="pressure (MPa)")
left.legend(frameon=False)
right.set(xlabel="radius r (mm)", ylabel="temperature of the upper ring (K)")
plt.show()
last = hot.isel(half_cycle=-1)
print(f"at the end {float(last.temperature_punch.min()):.1f} to {float(last.temperature_punch.max()):.1f} K; the pressure "
      f"is {np.abs(last.pressure / even - 1).max():.1%} off that without heat")  # fmt: skip

# %% [markdown]
# ## A pin on a disc
#
# The pin is held at its top and may tilt: friction presses its leading edge, and the pin wears to a slope. A map shows
# the pressure on its face, with the disc's way as an arrow; cuts go along and across the sliding.

# %%
history, summary = run("pin-on-disc", f"run.half_cycles={100 if COARSE else 2000}", *LINEAR)
fields, chosen = fields_of(history), [int(n) for n in history.half_cycle[::2]]
screen.display(map_figure(history, fields["pressure"], chosen))
screen.display(lines_figure(history, [fields["pressure"], fields["wear"]], chosen))
worn = summary["punch"]
print(f"worn: {worn['worn_volume_mm3']:.4g} mm³, at most {1e3 * worn['largest_depth_mm']:.3g} µm deep")

# %% [markdown]
# ## A ball on a flat
#
# Both wear; the flat's scar is longer, by the stroke. Whatever the pressure does, the volume is coefficient times load
# times sliding distance.

# %%
history, summary = run("ball-on-flat", f"run.half_cycles={10 if COARSE else 40}", "motion.positions=3",
                       "geometry.parameters.across=6", "geometry.degree=1", "geometry.order=1")  # fmt: skip
chosen = [int(history.half_cycle[-1])]
for name in ("wear", "wear_strip"):
    screen.display(map_figure(history, fields_of(history)[name], chosen))
for body, coefficient in (("punch", 1e-8), ("strip", 2e-8)):
    by_hand = coefficient * 20 * 0.2 * chosen[0]
    print(f"{body}: {summary[body]['worn_volume_mm3']:.6g} mm³, by hand {by_hand:.6g} mm³")
print(f"scars: {float(history.scar_length[-1]):.3f} mm on the ball, {float(history.scar_length_strip[-1]):.3f} mm "
      "on the flat")  # fmt: skip

# %% [markdown]
# ## A brake pad
#
# A sector of a ring on a disc is guided so that it cannot tilt. It wears until p r is uniform, too, whatever the
# heat. The pressure is then 1.989 MPa at the inner radius of 60 mm and 1.194 MPa at the outer radius of 100 mm.
#
# `fenwear run brake-pad` follows it, with the temperatures on the same maps, and `fenwear plot` draws both bodies near
# the contact.

# %%
folder.cleanup()
