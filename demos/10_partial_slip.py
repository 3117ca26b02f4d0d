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
# # 10. From full stick to gross sliding
#
# A steel cylinder is pressed on a steel flat, whose bottom moves to and fro by a few micrometres. With `contact.law =
# "coulomb"` each contact node sticks or slips. The bodies take up a stroke of half a micrometre elastically. A longer
# stroke makes the edges of the contact slip, and a still longer stroke all of it. Then partial slip wears, to a shape
# that wears no more.

# %%
# %matplotlib inline
import os

import matplotlib.pyplot as plt
import numpy as np

from fenwear import assemble, jump, load_case, march, steady, vary
from fenwear.steps.stick_final import final_shape
from fenwear.steps.stick_state import TimeStepRecords

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements
ELEMENTS = 30 if COARSE else 40

BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "0.6"
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": "medium"})

# %% [markdown]
# ## One cycle with seven strokes
#
# The bodies are set up once; another stroke is a variant of the system. The flat keeps its place under the cylinder
# (`motion.positions = 1`): it moves by no more than a few nodes. `march` yields half-cycles, each with its time steps.

# %%
settings = [f"geometry.parameters.elements_along_contact={ELEMENTS}", "motion.positions=1"]
case = load_case("fretting-partial-slip", settings)
system = assemble(case)
stepped = vary(system, "stick.steps=40")
x, weights = system.pair.x, system.pair.weights

load, radius, mu = 120.0, 6.0, case.contact.friction  # N/mm, mm
modulus = 200e3 / (2 * (1 - 0.3**2))  # MPa: E* of two like bodies
a = np.sqrt(4 * load * radius / (np.pi * modulus))  # Hertz's half-width, mm


def time_steps(blocks):
    """Return the time steps of all half-cycles of blocks, one after the other."""
    return TimeStepRecords.joined([steps.records for block in blocks for steps in block.steps])


def first_cycle(system, amplitude):
    """Return the time steps of the first cycle with an amplitude in µm."""
    return time_steps(march(vary(system, f"motion.amplitude='{amplitude} um'"), 2))


cycles = {amplitude: first_cycle(stepped, amplitude) for amplitude in (0.2, 1, 2, 3, 4, 5, 8)}
print(f"contact: half-width {1e3 * weights @ (cycles[1].pressure > 0).any(axis=0) / 2:.1f} µm, by Hertz {1e3 * a:.1f}")
for amplitude, records in cycles.items():
    sticks = weights @ records.sticking.all(axis=0)
    touches = weights @ (records.pressure > 0).any(axis=0)
    regime = "full stick" if sticks == touches else "partial slip"
    if not records.sticking.any(axis=1).all():
        regime = "gross sliding"
    print(f"±{amplitude:3} µm: force up to {np.abs(records.force).max():6.2f} N/mm of {mu * load:.0f}, "
          f"{100 * sticks / touches:3.0f} % stick all through: {regime}")  # fmt: skip

# %% [markdown]
# ## Fretting loops
#
# Full stick is a line. At the edges of the contact the pressure vanishes, so that a little always slips there. With
# ±0.2 µm it is no more than a node or two. Partial slip is a thin loop, gross sliding a parallelogram whose height is
# twice $\mu P$. Its width is the slip, and the slope of its sides is the elastic compliance of the bodies.

# %%
figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained", sharey=True)
for amplitude, colour in ((2, GREEN), (4, BLUE), (8, RED)):
    records = cycles[amplitude]
    closed = np.arange(len(records) + 1) % len(records)  # the end of a cycle is its beginning
    axes[0].plot(1e3 * records.displacement[closed], records.force[closed], color=colour, label=f"±{amplitude} µm")
stiffness = np.ptp(cycles[0.2].force) / np.ptp(cycles[0.2].displacement)  # of full stick, N/mm per mm
for amplitude, colour in ((2, GREEN), (4, BLUE)):
    records = cycles[amplitude]
    closed = np.arange(len(records) + 1) % len(records)
    beyond = records.displacement - records.force / stiffness
    axes[1].plot(1e3 * beyond[closed], records.force[closed], color=colour)
axes[0].set(xlabel="displacement of the flat (µm)", ylabel="tangential force (N/mm)", title="Fretting loops")
axes[1].set(xlabel="displacement beyond full stick's (µm)", title="Partial slip, without what is elastic")
axes[0].legend(frameon=False)
plt.show()

# %% [markdown]
# ## The stick zone of Cattaneo and Mindlin
#
# Like bodies whose tangential force goes between $\pm Q$ stick all the time for
# $|x| < c = a \sqrt{1 - Q / (\mu P)}$. At the extremes their traction is that of gross sliding less that of a smaller
# contact: $\mu p_0 \sqrt{1 - x^2/a^2}$, less $\mu p_0 (c/a) \sqrt{1 - x^2/c^2}$ inside of $c$.

# %%
figure, ax = plt.subplots(figsize=(7, 4), layout="constrained")
fine = np.linspace(-a, a, 801)
peak = mu * 2 * load / (np.pi * a)
for amplitude, colour in ((1, GREEN), (2, BLUE), (4, RED)):
    records = cycles[amplitude]
    at = len(records) // 2 - 1  # the end of the first half-cycle, one of the two extremes
    c = a * np.sqrt(1 - abs(records.force[at]) / (mu * load))
    exact = peak * np.sqrt(1 - (fine / a) ** 2)
    exact -= peak * c / a * np.sqrt(np.maximum(1 - (fine / c) ** 2, 0))
    found = records.traction[at, :, 0]
    found = found * np.sign(found.sum())
    ax.plot(1e3 * x, found, ".", color=colour, label=f"±{amplitude} µm")
    ax.plot(1e3 * fine, exact, color=colour, linewidth=0.8)
    stick = weights @ records.sticking[: at + 1].all(axis=0) / 2
    print(f"±{amplitude} µm: stick zone ±{1e3 * stick:.1f} µm, by Cattaneo and Mindlin ±{1e3 * c:.1f} µm, nodes every "
          f"{1e3 * np.diff(x).min():.1f} µm")  # fmt: skip
ax.set(xlabel="position along the contact (µm)", ylabel="tangential traction (MPa)", xlim=(-1.2e3 * a, 1.2e3 * a))
ax.set_title("Tractions at the largest force; lines: Cattaneo and Mindlin")
ax.legend(frameon=False)
plt.show()

# %% [markdown]
# ## Where and when it slips

# %%
records = cycles[3]
state = np.where(records.sticking, 2.0, np.where(records.pressure > 0, 1.0, np.nan))
figure, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
ax.pcolormesh(1e3 * x, np.arange(1, len(state) + 1) / len(state), state, cmap="coolwarm_r", vmin=0.7, vmax=2.3)
ax.set(xlabel="position along the contact (µm)", ylabel="part of the cycle", xlim=(-1.2e3 * a, 1.2e3 * a))
ax.set_title("±3 µm: stick blue, slip red. After each reversal all of it sticks first")
plt.show()

# %% [markdown]
# ## Work of friction
#
# Every branch of a loop is the first loading, twice as large (Mindlin and Deresiewicz). Beyond the displacement of
# full stick, half-planes move by $\mu P / (\pi E^*)\, g(q)$ with $q = Q / (\mu P)$ and $g = q + (1 - q) \ln(1 - q)$.
# This follows from Hertz's approach between the loads $P - Q / \mu$ and $P$. A loop then encloses
#
# $$ W = \frac{8 (\mu P)^2}{\pi E^*} \left( \frac{q\,g(q)}{2} - \int_0^q g \right) . $$
#
# The work of gross sliding continues beyond, by $4 \mu P$ times the remaining amplitude.


# %%
def work(q):
    """Return the work of a cycle of partial slip, N mm per mm."""
    rest = np.maximum(1 - q, 1e-300)
    g = q + rest * np.log(rest)
    integral = q**2 / 2 - 1 / 4 + rest**2 / 4 - rest**2 / 2 * np.log(rest)
    return 8 * (mu * load) ** 2 / (np.pi * modulus) * (q * g / 2 - integral)


largest = {amplitude: np.abs(records.force).max() / (mu * load) for amplitude, records in cycles.items()}
dissipated = {amplitude: records.energy(weights) for amplitude, records in cycles.items()}
partial = [amplitude for amplitude in cycles if 0.2 < amplitude < 5]
for amplitude in partial:
    exact = work(largest[amplitude])
    print(f"±{amplitude} µm: friction's work {1e3 * dissipated[amplitude]:.3f} µJ/mm, half-planes {1e3 * exact:.3f} "
          f"({100 * (dissipated[amplitude] / exact - 1):+.1f} %)")  # fmt: skip

q = np.linspace(0.01, 1, 200)
figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
axes[0].loglog(q, 1e3 * work(q), color=GREY, label="half-planes")
axes[0].loglog([largest[amplitude] for amplitude in partial], [1e3 * dissipated[amplitude] for amplitude in partial],
               "o", color=BLUE, label="fenwear")  # fmt: skip
axes[0].set(xlabel="largest force over µ P", ylabel="friction's work in a cycle (µJ/mm)", title="Partial slip")
axes[0].legend(frameon=False)
ratio = [dissipated[s] / (4 * np.abs(r.force).max() * s * 1e-3) for s, r in cycles.items()]
axes[1].plot(list(cycles), ratio, "o-", color=RED)
axes[1].axhline(0.2, color=GREY, linewidth=0.8)
axes[1].text(0.2, 0.21, "gross sliding above")
axes[1].set(xlabel="amplitude (µm)", ylabel="energy ratio", title="Share of the loop in its rectangle", ylim=(0, None))
plt.show()

# %% [markdown]
# The energy ratio is the loop's area over $4\,Q_{max}\,\delta_{max}$; above 0.2 sliding is called gross (Fouvry).
#
# ## The running map
#
# Which of the three it is follows from load and stroke: the running map of a rig. A larger load holds a longer stroke, so
# that the border of gross sliding, where nothing sticks all through the cycle, runs upwards.

# %%
loads, amplitudes = np.linspace(30, 210, 4 if COARSE else 7), np.linspace(0.5, 8, 6 if COARSE else 16)  # N/mm, µm
stuck = np.zeros((len(loads), len(amplitudes)))
for row, force in enumerate(loads):
    held = vary(stepped, f'punch.loads=[{{on="punch_top", force=["0 N", "-{force} N"]}}]')
    for column, amplitude in enumerate(amplitudes):
        records = first_cycle(held, amplitude)
        touches = weights @ (records.pressure > 0).any(axis=0)
        stuck[row, column] = weights @ records.sticking.all(axis=0) / touches

figure, ax = plt.subplots(figsize=(6.5, 3.8), layout="constrained")
shown = ax.pcolormesh(amplitudes, loads, 100 * stuck, cmap="viridis", vmin=0, vmax=100)
ax.text(0.97, 0.06, "gross sliding", color="white", ha="right", transform=ax.transAxes)
ax.set(xlabel="amplitude of the stroke (µm)", ylabel="load (N/mm)")
figure.colorbar(shown, label="of the contact: sticks all through (%)")
plt.show()
border = [amplitudes[row > 0].max() for row in stuck]
print(
    "longest stroke that sticks anywhere:",
    ", ".join(f"±{b:.1f} µm at {p:.0f} N/mm" for b, p in zip(border, loads, strict=True)),
)

# %% [markdown]
# ## Partial slip wears a scar beside the stick zone
#
# `jump` takes many cycles in one step of controlled error, with the stroke of ±3 µm of the case. `steady` finds the
# final shape without the cycles before. In the end the stick zone alone carries the load, and beside it the bodies
# are worn until no pressure is left. `steady` takes the stick zone of the second cycle; `final_shape` can be given
# another one.

# %%
rows = [
    (block, k)
    for block in jump(system, 600_000, tolerance=0.05)
    for k in range(len(block))
    if block.half_cycle[k] % 2 == 0
]
ends = {
    "stick zone of the second cycle": steady(system),
    "stick zone of the last cycle": final_shape(system.law_state.problem, rows[-1][0].steps[-1].stuck),
}


def both(block, k):
    """Return the depths of both bodies together at the contact nodes, mm."""
    return system.pair.opening(block.wear[k], block.wear_strip[k])


def work_of(block, k):
    """Return friction's work in the cycle that ends with a half-cycle, N mm per mm."""
    return sum(steps.records.energy(weights) for steps in block.steps[k - 1 : k + 1])


print(f"{rows[-1][0].half_cycle[-1] // 2:,} cycles in {len(rows) - 1} steps; estimated error of the worst one "
      f"{max(block.steps[k].jump_error for block, k in rows):.3f} of what it wore")  # fmt: skip
chosen = [
    min(rows, key=lambda row: abs(row[0].half_cycle[row[1]] // 2 - cycles)) for cycles in (1, 2_000, 20_000, 300_000)
]
print("    cycles   area worn off both (µm²)   friction's work in a cycle (µJ/mm)")
for block, k in chosen:
    print(f"{block.half_cycle[k] // 2:10,} {1e6 * weights @ both(block, k):20.2f} {1e3 * work_of(block, k):30.2f}")
for name, end in ends.items():
    print(f"in the end {1e6 * weights @ end.depth:19.2f}   {name}, {1e3 * weights @ end.stick:.1f} µm wide")

figure, axes = plt.subplots(2, 1, figsize=(7, 7), sharex=True, layout="constrained")
for (block, k), colour in zip(chosen, ("0", GREEN, BLUE, RED), strict=True):
    pressed = block.steps[k].pressure[-1]
    axes[0].plot(1e3 * x, pressed, color=colour, label=f"{block.half_cycle[k] // 2:,} cycles")
    axes[1].plot(1e3 * x, 1e3 * both(block, k), color=colour)
axes[0].plot(1e3 * x, end.pressure, "k:", label="in the end")
axes[1].plot(1e3 * x, 1e3 * end.depth, "k:")
axes[0].set(ylabel="pressure (MPa)", title="The stick zone takes over the load")
axes[0].legend(frameon=False, loc="upper left", fontsize="small")
axes[1].set(xlabel="position along the contact (µm)", ylabel="worn off both bodies (µm)", xlim=(-1.4e3 * a, 1.4e3 * a))
axes[1].set_title("Beside it a scar deepens, to a shape that wears no more")
axes[1].invert_yaxis()
plt.show()

# %% [markdown]
# A mesh resolves the stick zone to a node at each side. A zone that is narrower by that has a scar larger by a fifth
# here. On some meshes the outermost node begins to slip as the scar beside it deepens. Then give the zone of the last
# cycle to `final_shape`. The pressure at the edges of the stick zone has no bound: it grows as the node spacing
# falls.
#
# `fenwear run fretting-partial-slip` writes all of this to `history.nc` and draws it in a report, and `fenwear steady
# fretting-partial-slip` prints the final shape. With a stroke as long as to slip as a whole there is none.

# %% [markdown]
# ## A sphere
#
# In solids traction and slip have two components. A sphere of 10 mm on a flat, `fretting-sphere`, sticks in a circle
# of the radius $c = a\,(1 - Q / (\mu P))^{1/3}$ (Mindlin). Around it the sphere slips along the stroke. The traction
# is that of gross sliding less that of a smaller contact, as in the plane.

# %%
across = 6 if COARSE else 8
amplitude = 0.75  # µm
settings = [f"geometry.parameters.across={across}", f"motion.amplitude={amplitude} um", "stick.steps=6"]
case = load_case("fretting-sphere", settings)
sphere = assemble(case)
records = time_steps(march(sphere, 2))
pair, weights = sphere.pair, sphere.pair.weights
along, over = pair.punch.x[:, 0], pair.punch.x[:, 1]

load, radius, mu = 50.0, 10.0, case.contact.friction  # N, mm
modulus = 210e3 / (2 * (1 - 0.3**2))
a = (3 * load * radius / (4 * modulus)) ** (1 / 3)
peak = 3 * load / (2 * np.pi * a**2)
at = len(records) // 2 - 1  # the end of the first half-cycle
c = a * (1 - abs(records.force[at]) / (mu * load)) ** (1 / 3)
sticking, touching = records.sticking[at], records.pressure[at] > 0
print(f"±{amplitude} µm: force {abs(records.force[at]):.1f} N of {mu * load:.0f}")
for name, nodes, exact in (("contact", touching, a), ("stick zone", sticking, c)):
    print(f"radius of the {name}: {1e3 * np.sqrt(weights[nodes].sum() / np.pi):.0f} µm, exact {1e3 * exact:.0f}; "
          f"nodes every {1e3 * np.sqrt(np.median(weights)):.0f} µm")  # fmt: skip

# %%
traction = records.traction[at] * np.sign(records.traction[at, :, 0].sum())
figure, axes = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained")
for nodes, colour, name in ((sticking, BLUE, "stick"), (touching & ~sticking, RED, "slip")):
    axes[0].quiver(1e3 * along[nodes], 1e3 * over[nodes], *traction[nodes].T, color=colour, label=name, scale=9e3)
turn = np.linspace(0, 2 * np.pi, 200)
for size in (a, c):
    axes[0].plot(1e3 * size * np.cos(turn), 1e3 * size * np.sin(turn), color=GREY, linewidth=0.8)
axes[0].set(xlabel="x (µm)", ylabel="y (µm)", aspect="equal", title="Traction on the sphere; circles: exact")
axes[0].legend(frameon=False, loc="upper right")
line = np.abs(over) < 1e-6
order = np.argsort(along[line])
fine = np.linspace(-a, a, 401)
exact = np.sqrt(1 - (fine / a) ** 2) - c / a * np.sqrt(np.maximum(1 - (fine / c) ** 2, 0))
axes[1].plot(1e3 * along[line][order], traction[line, 0][order], "o", color=BLUE, label="fenwear")
axes[1].plot(1e3 * fine, mu * peak * exact, color=GREY, label="Mindlin")
axes[1].set(xlabel="x (µm)", ylabel="traction along x, at y = 0 (MPa)", xlim=(-1.3e3 * a, 1.3e3 * a), ylim=(0, None))
axes[1].legend(frameon=False)
plt.show()
