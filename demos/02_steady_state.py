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
# # 2. The steady state and its parameters
#
# A reciprocating punch wears until its shape fits both sliding directions. From then on every cycle is like the last:
# the **cyclic steady state**. fenwear solves for it directly, in some milliseconds. This notebook shows it, and why
# its largest pressure is twice the mean. Then it changes friction, load, the wear law, and the height of the hinge.

# %%
# %matplotlib inline
import os
import time

import matplotlib.pyplot as plt
import numpy as np

from fenwear import FenwearError, assemble, cycles_to_reach, jump, load_case, steady, vary

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements
settings = ["geometry.degree=2", "geometry.parameters.elements_along_contact=8"] if COARSE else []

# Legible in print and for the colour-blind.
BLUE, RED, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
DASHES = ("-", "--", "-.", ":")
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": "medium"})


# %% [markdown]
# `assemble` makes the meshes and factors the two bodies: that is the costly part, done once.

# %%
system = assemble(load_case("example1", settings))
state = steady(system)

x, mean = system.pair.x, system.rigid.mean_pressure
print(f"solved in {1000 * state.seconds:.0f} ms, {state.iterations} Newton iterations")
for d, pressure, width in zip(state.directions, state.pressure, state.contact_width, strict=True):
    way = "rightward" if d > 0 else "leftward"
    print(f"{way:9}  largest pressure {pressure.max():.3f} MPa, width in contact {width:.1f} mm")
print(f"mean pressure {mean:.3f} MPa")

# %% [markdown]
# ## Why twice the mean
#
# In the steady state one cycle wears the same depth everywhere, up to a rigid motion of the punch. With the wear law
# $\dot w = \tilde\beta\, p^b v^a$ this reads
#
# $$ p_+^b + p_-^b = C_0 + C_1 x , $$
#
# where $p_+$ and $p_-$ are the pressures in the two directions. Take $b = 1$. Friction turns the punch as much one way
# as the other in a cycle, so $C_1 = 0$ and the sum is uniform. Each of the two pressures carries the load, so the sum is
# twice the mean. Where the surfaces open in one direction ($p_- = 0$), the other pressure is all of the sum:
# $p_+ = 2\,p_m = 33.33$ MPa. Páczelt and Mróz report the same value.

# %%
figure, axes = plt.subplots(2, 1, figsize=(7, 6), sharex=True, layout="constrained")
axes[0].plot(x, state.pressure[0], color=BLUE, label="$p_+$, strip moves rightward")
axes[0].plot(x, state.pressure[1], "--", color=RED, label="$p_-$, strip moves leftward")
axes[0].plot(x, state.pressure.sum(axis=0), "-.", color="0", label="$p_+ + p_-$")
axes[0].set_ylabel("pressure (MPa)")
axes[0].set_ylim(0, 2.3 * mean)
axes[0].legend(frameon=False, loc="lower center")
axes[0].set_title("Cyclic steady state of Example 1", loc="left")
axes[1].plot(x, 1000 * state.shape, color="0")
axes[1].set_ylabel("shape (µm)")
axes[1].set_xlabel("position along the contact x (mm)")
axes[1].set_title("Worn depth, without the part that is a rigid motion", loc="left")
plt.show()

# %% [markdown]
# ## How long does it take to get there?
#
# `jump` follows the wear over many cycles in one step, with an error estimate that chooses the length of each step. It
# yields the last cycle of each jump.

# %%
cycles, distance = [], []
begin = time.perf_counter()
for block in jump(system, 2_000_000, tolerance=3e-3):
    cycles.extend(block.half_cycle[1::2] // 2)
    pressures = block.pressure.reshape(-1, *state.pressure.shape)
    distance.extend(np.abs(pressures - state.pressure).max(axis=(1, 2)) / mean)
print(f"{cycles[-1]:,} cycles in {len(cycles)} jumps, {time.perf_counter() - begin:.1f} s")

needed = cycles_to_reach(system, state, 0.01)
figure, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
ax.loglog(cycles, distance, ".-", color=BLUE)
ax.axhline(0.01, color="0.5", linestyle=":", linewidth=0.8)
ax.axvline(needed, color="0.5", linestyle=":", linewidth=0.8)
ax.annotate(f"1 % after {needed:,} cycles", (needed, 0.01), (6, 6), textcoords="offset points")
ax.set_xlabel("cycles")
ax.set_ylabel("largest difference / mean (-)")
ax.set_title("Distance of the pressures to the steady state", loc="left")
plt.show()

# %% [markdown]
# The dots are the ends of jumps: short while the pressures change fast, long towards the end. The run meets the state
# that `steady` finds without any of these steps.
#
# ## A sweep
#
# `vary` returns the same system with other values and shares all that they leave as it is. Friction, load, wear law
# and motion factor nothing again, so a sweep costs milliseconds per point. Geometry and materials make a new system.


# %%
def sweep(name, unit, values, setting):
    """Solve for each value of one parameter; `setting` turns a value into overrides."""
    return name, unit, [(value, steady(vary(system, *setting(value)))) for value in values]


def show(name, unit, states):
    """Draw pressure (rightward) and shape for each value."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for (value, found), colour, dash in zip(states, (BLUE, RED, GREEN, PURPLE), DASHES, strict=False):
        label = f"{value:g} {unit}".strip()
        left.plot(x, found.pressure[0], color=colour, linestyle=dash, label=label)
        right.plot(x, 1000 * found.shape, color=colour, linestyle=dash, label=label)
    left.set(xlabel="x (mm)", ylabel="$p_+$ (MPa)", title="Pressure, strip moves rightward")
    left.set_ylim(bottom=0)
    right.set(xlabel="x (mm)", ylabel="shape (µm)", title="Worn shape")
    left.legend(title=name, frameon=False)
    plt.show()


begin = time.perf_counter()
friction = sweep("friction coefficient", "", (0.1, 0.2, 0.3, 0.4), lambda v: [f"contact.friction={v}"])
force = sweep("load", "kN", (2, 5, 10, 20), lambda v: [f"punch.loads.0.force=[0, {-1000 * v}]"])
law = sweep(
    "exponent b",
    "",
    (0.5, 1, 2),
    lambda v: [f"wear.punch={{coefficient='3.93e-8 MPa^-{v}', pressure_exponent={v}}}"],
)
print(f"{4 + 4 + 3} steady states in {time.perf_counter() - begin:.2f} s")

# %% [markdown]
# **Friction** tilts the punch. More of it moves more of the pressure to one side and widens the zone that opens in every
# second half-cycle. The largest pressure stays at twice the mean.

# %%
show(*friction)

# %% [markdown]
# **Load**: everything is proportional to it here. The surfaces are flat at first and the bodies linear, so pressures and
# shapes for other loads are the same curves on another scale.

# %%
show(*force)

# %% [markdown]
# **Wear law**: the exponent $b$ does change the largest pressure. Now $p_+^b + p_-^b$ is the same everywhere, but for
# a small slope. A large $b$ wears high pressures off harder, and the steady state is more even. The wear coefficient
# itself and the exponent $a$ of the speed do not change the steady state. They only set its time, as the last table
# shows.

# %%
show(*law)
for value, found in law[2]:
    print(f"b = {value:3g}: largest pressure {found.pressure.max() / mean:.3f} times the mean")

# %%
print("cycles until the pressures are within 1 % of the pressure scale:")
for factor in (0.5, 1.0, 2.0):
    varied = vary(system, f"wear.punch.coefficient={factor * 3.93e-8}")
    found = steady(varied)
    print(f"  wear coefficient x {factor:3g}: {cycles_to_reach(varied, found, 0.01):7,} cycles")

# %% [markdown]
# ## The height of the hinge
#
# The hinge is a part of the geometry, so each height is a new system. Set-up takes under a second without heat. The
# moment of friction about the hinge is $\mu F l_z$: a higher hinge does what more friction does.

# %%
for height in (20, 40):
    other = assemble(load_case("example1", [*settings, f"geometry.parameters.pin_height_1={height}"]))
    found = steady(other)
    print(f"l_z = {height} mm: largest pressure {found.pressure.max():.3f} MPa, "
          f"width in contact {found.contact_width.min():.1f} mm")  # fmt: skip

# %% [markdown]
# ## Try it
#
# With ipywidgets installed, move the sliders: each step solves for a steady state. If friction
# tips the punch over, or tilts it so far that no steady state exists, a message says so.


# %%
def explore(friction=0.25, load_kN=10.0, b=1.0):
    """Solve and draw the steady state of these values."""
    try:
        found = steady(
            vary(
                system,
                f"contact.friction={friction}",
                f"punch.loads.0.force=[0, {-1000 * load_kN}]",
                f"wear.punch={{coefficient='3.93e-8 MPa^-{b}', pressure_exponent={b}}}",
            )
        )
    except FenwearError as error:
        print(error)
        return
    figure, ax = plt.subplots(figsize=(7, 3.4), layout="constrained")
    ax.plot(x, found.pressure[0], color=BLUE, label="$p_+$, rightward")
    ax.plot(x, found.pressure[1], "--", color=RED, label="$p_-$, leftward")
    ax.set(xlabel="x (mm)", ylabel="pressure (MPa)")
    ax.set_ylim(bottom=0)
    ax.legend(frameon=False)
    ax.set_title(f"friction {friction:g}, load {load_kN:g} kN, b = {b:g}", loc="left")
    plt.show()


try:
    from ipywidgets import interact

    interact(explore, friction=(0.0, 0.6, 0.05), load_kN=(1.0, 30.0, 1.0), b=(0.5, 3.0, 0.25))
except ImportError:
    print("no sliders: ipywidgets is missing (Debian: python3-ipywidgets). Call explore(...) with your values instead.")
    explore(friction=0.4, b=2.0)

# %% [markdown]
# ## What stays open
#
# - The steady state is what wear tends to without heat. With heat it may be unstable (notebook 3).
# - Only the punch wears here. Where the strip wears too, its worn track moves with it, and `run` follows that. A steady
#   state exists where the track keeps its shape (the page Let both bodies wear).
# - The heights of the hinges of Example 2 are not in the paper. They do not matter there: that punch cannot tilt.
