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
# # 7. Fretting: two bodies that wear
#
# A steel cylinder is pressed on a steel flat, which moves under it by ±25 µm. Both wear. The strip's wear belongs to
# the strip's own material, and the stroke carries it to and fro under the cylinder. Each half-cycle has several
# **positions** of the flat, each with a contact of its own. You see the line contact of Hertz turn into a worn one,
# and how sure its numbers are.

# %%
# %matplotlib inline
import os
import time

import matplotlib.pyplot as plt
import numpy as np

from fenwear import CaseError, ConvergenceError, assemble, jump, load_case, steady, vary

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements and cycles
ELEMENTS, CYCLES = (16, (100, 500, 1_000)) if COARSE else (30, (1_000, 5_000, 18_000))

BLUE, RED, GREEN = "#0072B2", "#D55E00", "#009E73"
DASHES = ("-", "--", "-.")
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": "medium"})

# %% [markdown]
# ## The start is Hertz's contact
#
# Two like bodies under the load $P$ per length, $E^* = E / (2 (1 - \nu^2))$: half-width $a = \sqrt{4 P R / (\pi E^*)}$
# and largest pressure $p_0 = 2 P / (\pi a)$.

# %%
settings = [f"geometry.parameters.elements_along_contact={ELEMENTS}"]
system = assemble(load_case("fretting", settings))

load, radius, modulus = 18.5, 6.0, 200e3 / (2 * (1 - 0.3**2))  # N/mm, mm, MPa
a = np.sqrt(4 * load * radius / (np.pi * modulus))
start = system.contact((1,)).solve(system.pair.initial_gap)
x = system.pair.x
print(f"Hertz:   half-width {1e3 * a:.1f} µm, largest pressure {2 * load / (np.pi * a):.1f} MPa")
closed = system.pair.weights @ (start.pressure[0] > 0)  # the length that the nodes in contact stand for
print(f"fenwear: half-width {1e3 * closed / 2:.1f} µm, largest pressure {start.pressure.max():.1f} MPa, "
      f"with nodes every {1e3 * np.diff(x).min():.0f} µm")  # fmt: skip

# %% [markdown]
# ## Thousands of cycles by jumps
#
# `jump` takes many cycles in one implicit step and chooses how many by an error estimate. The loss of both bodies is
# known beforehand, $k F s$ with the sliding distance $s$. It holds to rounding for any length of the jumps.

# %%
begin = time.perf_counter()
blocks, reached = {}, None
for cycles in CYCLES:
    *_, blocks[cycles] = jump(system, 2 * cycles, tolerance=0.05, start=reached)
    reached = blocks[cycles].end
print(f"{CYCLES[-1]:,} cycles in {time.perf_counter() - begin:.1f} s")

strip = system.pair.strip
for cycles in CYCLES:
    block = blocks[cycles]
    distance = cycles * 4 * 0.025  # mm
    lost = system.pair.weights @ block.wear[-1], strip.weights @ block.wear_strip[-1]
    exact = 1.9e-8 * load * distance, 2.9e-8 * load * distance
    print(f"after {cycles:6,} cycles: flat {1e3 * block.wear_strip[-1].max():.3f} µm deep, cylinder "
          f"{1e3 * block.wear[-1].max():.3f} µm, largest pressure {block.largest_pressure[-1]:.0f} MPa; "
          f"lost / known: {lost[0] / exact[0]:.12f}, {lost[1] / exact[1]:.12f}")  # fmt: skip

# %%
figure, axes = plt.subplots(2, 1, figsize=(7, 7), sharex=True, layout="constrained")
axes[0].plot(1e3 * x, start.pressure[0], color="0", label="start")
for cycles, colour, dashes in zip(CYCLES, (BLUE, RED, GREEN), DASHES, strict=True):
    block = blocks[cycles]
    axes[0].plot(1e3 * x, block.pressure[-1], dashes, color=colour, label=f"{cycles:,} cycles")
    axes[1].plot(1e3 * x, 1e3 * block.wear[-1], dashes, color=colour)
    axes[1].plot(1e3 * strip.x[:, 0], -1e3 * block.wear_strip[-1], dashes, color=colour)
axes[0].set_ylabel("pressure in mid-stroke (MPa)")
axes[0].set_ylim(bottom=0)
axes[0].legend(frameon=False)
axes[0].set_title("The contact widens and its pressure becomes even", loc="left")
axes[1].axhline(0, color="0.5", linewidth=0.8)
axes[1].set_xlim(1e3 * strip.x[[0, -1], 0])
axes[1].set_ylabel("worn depth (µm):\n← flat, down      cylinder, up →")
axes[1].set_xlabel("position along the contact (µm)")
axes[1].set_title("What is worn off: the flat's scar is wider by the stroke", loc="left")
plt.show()

# %% [markdown]
# In mid-stroke the contact is narrower than both scars. The flanks of the cylinder's scar meet those of the flat's
# only towards the ends of the stroke. A model with one position cannot know that.

# %% [markdown]
# ## How sure are these numbers?
#
# Vary what is only numerics: the length of the jumps and the positions of the flat in a half-cycle. (The spacing of
# the nodes, too: `tests/benchmarks/fretting.py --fine` prints the whole table.)

# %%
last = CYCLES[1]
for text, tolerance, varied in (
    ("as above", 0.05, ()),
    ("shorter jumps", 0.02, ()),
    ("5 positions", 0.05, ("motion.positions=5",)),
    ("21 positions", 0.05, ("motion.positions=21",)),
):
    other = vary(system, *varied) if varied else system
    begin = time.perf_counter()
    *_, block = jump(other, 2 * last, tolerance=tolerance)
    print(f"{text:14} after {last:,} cycles: flat {1e3 * block.wear_strip[-1].max():.4f} µm, "
          f"{block.largest_pressure[-1]:5.1f} MPa, {time.perf_counter() - begin:4.1f} s")  # fmt: skip

# %% [markdown]
# ## No steady state, and a stroke that is too long
#
# The track of a flat that wears deepens without end: fenwear reports that it has no steady state. It also reports a
# stroke that leaves the flat's mesh.

# %%
try:
    steady(system)
except ConvergenceError as error:
    print(error)
try:
    vary(system, "motion.amplitude=0.5 mm")
except CaseError as error:
    print(error)
