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
# # 12. What lies between
#
# One contact has each term in turn: a third body, a compliant layer, a coating, a hardness, creep, mixed lubrication.
# What does each change in the depth, in the pressure, and in the life? The contact is a steel cylinder of 6 mm radius
# that slides 0.1 mm to and fro on a flat under 120 N/mm. It wears alone, and its life ends when it is worn by 1 µm.

# %%
# %matplotlib inline
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray

from fenwear import assemble, load_case, march
from fenwear.studies.run import run_case

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements
folder = tempfile.TemporaryDirectory()
LIFE = 1e-3  # mm, the depth at which it ends

CONTACT = [
    "title='A cylinder that slides on a flat'",
    f"geometry.parameters.elements_along_contact={20 if COARSE else 40}",
    "geometry.parameters.contact_width='0.5 mm'",
    "geometry.parameters.overlap=0.1",
    "geometry.follow_wear='never'",
    "contact={law='gross-sliding', friction=0.3}",
    "stick={}",
    "motion={kind='reciprocating', profile='triangular', amplitude='50 um', period='0.2 s'}",
    "wear={punch={coefficient='2e-8 1/MPa'}}",
    "run.half_cycles=1200",
    "run.jump_tolerance=0.003",
    "output.report=false",
    "output.uncertainty=false",
    "output.fields_at=[1100]",  # the mean over the last 50 cycles is drawn
]
TERMS = {
    "nothing": [],
    "third body": ["contact.third_body={share=0.6, life='200 mm'}"],
    "compliant layer": ["contact.layer={kind='exponential', length='0.5 um', pressure='20 MPa'}"],
    "coating": ["wear.punch.coating={thickness='0.3 um', coefficient='5e-9 1/MPa'}"],
    "hardness": ["contact.hardness='600 MPa'"],
    "creep": ["punch.creep={terms=[{compliance=0.5, time='20 s'}]}"],
    "mixed lubrication": ["contact.lubrication={asperity_share=0.5, fluid_friction=0.01}"],
}


def run(name, settings):
    """Run the contact with a term; return its history and its summary."""
    case = load_case("fretting-partial-slip", [*CONTACT, *settings])
    summary, directory = run_case(case, name, Path(folder.name) / name, lambda _: None, progress="none")
    with xarray.open_dataset(directory / "history.nc", engine="h5netcdf") as history:
        return history.load(), summary


runs = {name: run(name.replace(" ", "-"), settings) for name, settings in TERMS.items()}

# %% [markdown]
# ## Depth, pressure, life
#
# The table has the depth that the cylinder has lost, and the largest pressure at the start and at the end. The life
# is the cycles until 1 µm. Wear is proportional to load times path, so that only the coating and the lubricant change
# the final volume. The others change where it is worn: a wider contact makes the scar shallower.


# %%
def life(history):
    """Return the cycles until the largest depth is reached, between the recorded ones."""
    return float(np.interp(LIFE, history.wear.max("x"), history.half_cycle / 2, right=np.nan))


print(f"{'':18}{'depth µm':>10}{'p start':>10}{'p end MPa':>10}{'worn µm²':>10}{'life':>8}")
for name, (history, summary) in runs.items():
    pressure = history.pressure.max("x").values
    print(
        f"{name:18}{1e3 * summary['punch']['largest_depth_mm']:10.3f}{pressure[0]:10.0f}{pressure[-1]:10.0f}"
        f"{1e6 * summary['punch']['worn_area_mm2']:10.1f}{life(history):8.0f}"
    )

# %% [markdown]
# The pressure at the end is drawn as its mean over the last 50 cycles. A node at the edge, which the scar has just
# reached, carries more or less than its neighbours at an instant, on any mesh. It is worn down to them before the
# next one touches.


# %%
def mean_pressure(history, first=1100, last=1200):
    """Return the mean pressure between two half-cycles, by what it has added up to."""
    added = history.pressure_sum
    return (added.sel(half_cycle=last) - added.sel(half_cycle=first)) / (last - first)


fig, axes = plt.subplots(2, 2, figsize=(9, 6.2), layout="constrained")
(first, last), (scars, depths) = axes
for number, (name, (history, _)) in enumerate(runs.items()):
    style = {"color": "black", "lw": 2.2} if name == "nothing" else {"color": f"C{number - 1}", "lw": 1.2}
    x = 1e3 * history.x
    first.plot(x, history.pressure[0], label=name, **style)
    last.plot(x, mean_pressure(history), **style)
    scars.plot(x, -1e3 * history.wear[-1], **style)
    depths.plot(history.half_cycle / 2, 1e3 * history.wear.max("x"), **style)
first.set(ylabel="pressure in the first half-cycle (MPa)", xlabel="x (µm)")
last.set(ylabel="mean of the last cycles (MPa)", xlabel="x (µm)")
scars.set(ylabel="scar (µm)", xlabel="x (µm)")
depths.set(ylabel="largest depth (µm)", xlabel="cycle")
depths.axhline(1e3 * LIFE, color="grey", lw=0.8, ls=":")
fig.legend(*first.get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False)
plt.show()

# %% [markdown]
# ## What is there besides wear
#
# Debris that stays acts as material: it holds the surfaces apart, and worn = stored + ejected. Flow and creep look
# like wear to a profilometer, but are none: fenwear meters them apart. The sheet has the place and time at which the
# coating was first worn through.

# %%
print(f"debris stored  {1e6 * runs['third body'][1]['debris_volume_mm3']:8.1f} µm² over 1 mm")
print(f"       ejected {1e6 * runs['third body'][1]['ejected_volume_mm3']:8.1f}")
print(f"plastic depth  {1e3 * runs['hardness'][1]['largest_plastic_depth_mm']:8.3f} µm")
print(f"crept          {1e3 * runs['creep'][1]['punch']['largest_creep_depth_mm']:8.3f} µm")
coating = runs["coating"][1]
print(f"coating through first in cycle {coating['punch_coating_first_through_half_cycle'] / 2:.0f}", end=", ")
print(f"at x = {round(1e3 * coating['punch_coating_first_through_at_x_mm'], 1) + 0:.1f} µm")

fig, (left, right) = plt.subplots(1, 2, figsize=(9, 3), layout="constrained")
history = runs["coating"][0]
for number, cycle in enumerate((1, 100, 200, 300, 600)):
    row = int(np.abs(history.half_cycle.values / 2 - cycle).argmin())
    label = f"cycle {history.half_cycle.values[row] / 2:.0f}"
    left.plot(1e3 * history.x, 1e3 * history.coating[row], color=plt.cm.viridis(number / 5), label=label)
left.set(ylabel="coating left (µm)", xlabel="x (µm)")
left.legend(frameon=False, fontsize="small")
history = runs["third body"][0]
right.plot(1e3 * history.x, 1e3 * history.debris_thickness[-1], label="debris")
right.plot(1e3 * history.x, 1e3 * history.wear[-1], label="worn")
right.set(ylabel="third body (µm)", xlabel="x (µm)")
right.legend(frameon=False)
plt.show()

# %% [markdown]
# ## A Stribeck curve
#
# Mixed lubrication with a film that grows with the speed: at each speed a half-cycle of the same contact one way. With the share of
# the load that asperities carry both friction and wear fall, from those of the dry contact to those of the fluid.

# %%
ROUGHNESS = 0.4  # µm
FILM = (
    f"contact.lubrication={{film={{expression='0.02 * v ** 0.6', unit='um'}}, roughness='{ROUGHNESS} um', "
    "share_over_lambda=[[0, 1], [0.5, 0.6], [1, 0.3], [2, 0.1], [3, 0]], fluid_friction=0.01}"
)
curve = []
for speed in np.geomspace(1, 2000, 6 if COARSE else 12):
    one_way = f"motion={{kind='one-way', direction='rightward', speed='{speed} mm/s', duration='{1 / speed} s'}}"
    case = load_case("fretting-partial-slip", [*CONTACT, one_way, FILM, "run.integration='explicit'"])
    *_, last = march(assemble(case), 1)
    totals = last.totals
    friction = totals.of("work")[-1] / totals.of("load_path")[-1]
    curve.append((0.02 * speed**0.6 / ROUGHNESS, friction, totals.of("volume_punch")[-1] / totals.of("distance")[-1]))
ratio, friction, worn = np.array(curve).T

fig, left = plt.subplots(figsize=(5.5, 3), layout="constrained")
left.semilogx(ratio, friction, "o-", ms=4, color="black", label="friction")
left.set(xlabel="lambda, film over roughness", ylabel="coefficient of friction", ylim=(0, None))
right = left.twinx()
right.semilogx(ratio, 1e9 * worn, "s--", ms=4, color="C3", label="wear")
right.set(ylabel="worn volume over way (µm³/mm)", ylim=(0, None))
fig.legend(loc="outside upper center", ncols=2, frameon=False)
plt.show()

# %%
folder.cleanup()
