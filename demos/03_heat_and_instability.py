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
# # 3. Heat and its instability
#
# Friction makes heat, heat makes the punch bulge, and the bulge draws more pressure and so more heat to the same
# place. Wear works against it and removes the bulge. Which of the two wins decides whether the contact settles or
# runs away into a hot spot. Here you look at both outcomes. One parameter decides between them: the share $\kappa$ of
# the friction heat that enters the punch.
#
# Per area of contact the friction power is $q = \mu p v$, with $\kappa q$ into the punch and $(1 - \kappa) q$ into the
# strip. Temperatures are above the surroundings, in K.

# %%
# %matplotlib inline
import os
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np

from fenwear import assemble, critical_speed, growth_rate, load_case, march, steady, vary

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements, fewer half-cycles
settings = ["geometry.degree=2", "geometry.parameters.elements_along_contact=8"] if COARSE else []
half_cycles = 200 if COARSE else 2620

# Legible in print and for the colour-blind.
BLUE, RED, GREEN, PURPLE, BLACK = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "0"
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": "medium"})


# %% [markdown]
# The case is Example 1 of Páczelt and Mróz with heat, as `example1-heat-unstable` reads it. The two faces of the thin
# punch lose heat to the air, and all friction heat enters the bodies. (`example1-heat`, with insulated faces and half
# of the heat in the debris, is the calm case; notebook 6 compares the readings.) `assemble` factors the bodies and
# prepares the steps of heat conduction: some seconds. Everything after it shares that work, because it does not
# depend on $\kappa$.

# %%
system = assemble(load_case("example1-heat-unstable", settings))
x, mean = system.pair.x, system.rigid.mean_pressure
speed = system.motion.mean_speed
print(f"mean sliding speed {speed:.2f} mm/s, mean pressure {mean:.2f} MPa")
print(f"mean friction power {0.001 * system.case.contact.friction * 10_000 * speed:.1f} W")

# %% [markdown]
# ## The steady state for five values of $\kappa$
#
# For each $\kappa$:
#
# - the **cyclic steady state**, with periodic temperatures;
# - the **growth rate** of the least stable small disturbance of this state, wear included. Negative: it dies out.
#   Positive: a run moves away from the steady state, even from a start close to it;
# - the **critical speed** without wear: above it the full contact is unstable (Burton's thermo-elastic instability).

# %%
shares = (0.1, 0.2, 0.3, 0.4, 0.5)
states, rates, critical = [], [], []
print("kappa   temperature   largest pressure   growth rate   critical speed without wear")
for share in shares:
    varied = vary(system, f"heat.partition={share}")
    state = steady(varied)
    states.append(state)
    rates.append(growth_rate(varied, state))
    critical.append(critical_speed(varied, direction=1))
    print(f"{share:5.1f}   {state.heat.punch.max():8.2f} K   {state.pressure.max():12.2f} MPa   "
          f"{rates[-1]:+9.4f}/s   {critical[-1]:10.2f} mm/s")  # fmt: skip

# %%
figure, ((p_ax, t_ax), (r_ax, s_ax)) = plt.subplots(2, 2, figsize=(9, 6.4), layout="constrained")
for share, state, colour, dash in zip(shares, states, (BLUE, RED, GREEN, PURPLE, BLACK), DASHES, strict=True):
    p_ax.plot(x, state.pressure[0], color=colour, linestyle=dash, label=f"{share:g}")
    t_ax.plot(x, state.heat.punch[0], color=colour, linestyle=dash)
p_ax.set(xlabel="x (mm)", ylabel="pressure (MPa)", title="Steady pressure, strip moves rightward")
p_ax.set_ylim(bottom=0)
p_ax.legend(title="κ", frameon=False)
t_ax.set(xlabel="x (mm)", ylabel="temperature (K)", title="Steady temperature of the punch")
t_ax.set_ylim(bottom=0)
r_ax.axhline(0, color="0.5", linewidth=0.8)
r_ax.plot(shares, rates, "o-", color=BLUE)
r_ax.text(0.1, 0.012, "grows: unstable")
r_ax.text(0.5, -0.014, "dies out: stable", ha="right")
r_ax.set(xlabel="κ (-)", ylabel="growth rate (1/s)", title="Growth of a disturbance, with wear")
r_ax.set_ylim(-0.03, 0.12)
s_ax.plot(shares, critical, "o-", color=BLUE, label="critical speed, no wear")
s_ax.axhline(speed, color=RED, linestyle="--", label="mean speed of this motion")
s_ax.set(xlabel="κ (-)", ylabel="speed (mm/s)", title="Critical speed of the full contact")
s_ax.set_ylim(bottom=0)
s_ax.legend(frameon=False)
plt.show()

# %% [markdown]
# Look at these:
#
# - The steady **pressure** does not depend on $\kappa$. Balance and the wear law set it (notebook 2); the shape takes up
#   whatever the heat does.
# - The **temperature** is nearly proportional to $\kappa$ and almost uniform along the contact.
# - The **growth rate** changes its sign between $\kappa = 0.2$ and $0.3$. The critical speed falls below the speed of
#   the motion near $\kappa = 0.28$. It is close to proportional to $1/\kappa$, so the heat in the punch is what counts.
#   The punch's composite expands three times as much as steel and conducts a tenth of the heat.

# %%
for (lower, low), (upper, high) in pairwise(zip(shares, rates, strict=True)):
    if low < 0 <= high:
        print(
            f"stable up to about kappa = {lower + (upper - lower) * low / (low - high):.2f} (linear between the points)"
        )

# %% [markdown]
# ## Why faces that lose heat make it worse
#
# It sounds odd that cooling destabilises. But the heat that flows through the foot of the punch makes it bulge. At
# the same temperature a punch that loses heat all over takes in twice as much of it. The layer above the contact then
# bends twice as far. Insulate the faces and see for yourself: the same temperature at about half of $\kappa$, and
# stable.

# %%
insulated = vary(system, "heat.convecting_faces=false", "heat.partition=0.2")
alike = steady(insulated)
middle = np.abs(x).argmin()
same = np.interp(alike.heat.punch[0, middle], [state.heat.punch[0, middle] for state in states], shares)
print(f"faces insulated, kappa = 0.2: {alike.heat.punch[0, middle]:.1f} K in the middle, "
      f"growth {growth_rate(insulated, alike):+.4f}/s")  # fmt: skip
print(f"faces convect:   kappa = {same:.2f} for the same temperature, "
      f"growth {np.interp(same, shares, rates):+.4f}/s")  # fmt: skip

# %% [markdown]
# ## Two runs
#
# `march` follows every half-cycle from the cold, flat, unworn start: once with $\kappa = 0.2$, stable, and once with
# $\kappa = 0.5$, unstable.


# %%
def follow(varied):
    """Return half-cycles, pressures, largest pressure, width in contact and largest temperature of a run."""
    blocks = list(march(varied, half_cycles))
    return {
        "n": np.concatenate([b.half_cycle for b in blocks]),
        "pressure": np.concatenate([b.pressure for b in blocks]),
        "peak": np.concatenate([b.largest_pressure for b in blocks]),
        "width": np.concatenate([b.contact_width for b in blocks]),
        "temperature": np.concatenate([b.heat.largest_temperature for b in blocks]),
    }


runs = {0.2: follow(vary(system, "heat.partition=0.2")), 0.5: follow(system)}
for share, run in runs.items():
    print(f"kappa = {share}: at the end {run['peak'][-1]:.1f} MPa, {run['width'][-1]:.1f} mm in contact, "
          f"{run['temperature'][-1]:.1f} K; hottest {run['temperature'].max():.1f} K")  # fmt: skip

# %%
figure, axes = plt.subplots(3, 1, figsize=(7, 7.2), sharex=True, layout="constrained")
for (share, run), state, colour, dash in zip(runs.items(), (states[1], states[4]), (BLUE, RED), DASHES, strict=False):
    name = f"κ = {share:g}, {'stable' if share < 0.25 else 'unstable'}"
    for ax, key, end in zip(
        axes,
        ("peak", "width", "temperature"),
        (state.pressure.max(), state.contact_width.mean(), state.heat.punch.max()),
        strict=True,
    ):
        ax.plot(run["n"][::2], run[key][::2], color=colour, linestyle=dash, label=name)
        ax.axhline(end, color=colour, linestyle=":", linewidth=1)
axes[0].set(ylabel="pressure (MPa)", title="Largest pressure (dotted: steady state; the same for both)")
axes[0].set_ylim(0, 110)
axes[0].legend(frameon=False)
axes[1].set(ylabel="width (mm)", title="Width in contact")
axes[1].set_ylim(0, 65)
axes[2].set(ylabel="temperature (K)", title="Largest temperature of the contact surfaces", xlabel="half-cycle")
axes[2].set_ylim(bottom=0)
plt.show()

# %% [markdown]
# ## The contact narrows and splits
#
# The map shows the pressure of every rightward half-cycle of the run with $\kappa = 0.5$, one above the other. White is
# open.

# %%
run = runs[0.5]
rows = slice(0, None, 2)
shown = np.ma.masked_less_equal(run["pressure"][rows], 0)
figure, ax = plt.subplots(figsize=(7, 4.6), layout="constrained")
drawn = ax.pcolormesh(x, run["n"][rows], shown, cmap="viridis_r", vmin=0, vmax=80, shading="nearest", rasterized=True)
figure.colorbar(drawn, label="contact pressure (MPa)", extend="max")
ax.set(
    xlabel="position along the contact x (mm)", ylabel="half-cycle", title="Pressure, κ = 0.5, strip moves rightward"
)
plt.show()

# %%
figure, axes = plt.subplots(2, 1, figsize=(7, 5.2), sharex=True, layout="constrained")
moments = (1, 19, 59, 199) if COARSE else (1, 59, 399, 1599, 2199)
for n, colour, dash in zip(moments, (BLUE, RED, GREEN, PURPLE, BLACK), DASHES, strict=False):
    axes[0].plot(x, run["pressure"][n - 1], color=colour, linestyle=dash, label=f"{n:,}")
    axes[1].plot(x, runs[0.2]["pressure"][n - 1], color=colour, linestyle=dash)
axes[0].legend(title="half-cycle", frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
axes[0].set(ylabel="pressure (MPa)", title="κ = 0.5")
axes[1].set(ylabel="pressure (MPa)", title="κ = 0.2", xlabel="position along the contact x (mm)")
for ax in axes:
    ax.set_ylim(0, 85)
plt.show()

# %% [markdown]
# With $\kappa = 0.5$ this happens:
#
# 1. The cold flat punch starts with high pressures at its edges.
# 2. Within some hundred half-cycles the punch bulges and lifts its own edges off. The contact narrows to less than half
#    of its width. Pressure and temperature gather in the middle, at twice the temperature of the steady state.
# 3. There the punch wears faster. Slowly the contact widens again, and the worn middle carries less and less.
# 4. At about half-cycle 1850 the middle opens. Without friction heat it cools and shrinks, which opens it more: the
#    contact has split in two, and each part bulges for itself.
#
# With $\kappa = 0.2$ the same bulge forms at first, but wear removes it: the contact widens towards the steady state.
# It is slow, for the growth rate is close to zero; the run has not arrived yet.
#
# ## What stays open
#
# - The paper describes a bell-shaped punch, and a contact that narrows while the peak grows. The peak falls again after
#   $n = 1800$; nothing splits. The paper gives neither the shares of the heat nor whether the faces lose any. Notebook 6
#   shows which readings come near to its numbers; this one does not.
# - The course after an instability depends on small things. On a mesh twice as fine the later peaks are within 3 %. At
#   the end, where contact opens and closes, pressures at single points are less certain. Check the mesh before you rely
#   on a number there.
# - Material values are constants here, and only the punch wears. Both may be otherwise: properties that depend on the
#   temperature, and wear of the strip, have their pages in the documentation.
#
# ## Your turn
#
# - `vary(system, "heat.partition=0.5", "wear.punch.coefficient=4e-7")`: ten times the wear. Is it stable?
# - `vary(system, "motion.angular_frequency=5")`: half the speed. (fenwear prepares the steps of heat again: some seconds.)
# - `"heat.conductance='perfect'"`: no jump of temperature between punch and strip. Then the two share the heat by
#   themselves, whatever $\kappa$ is.
