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
# # 6. Beside the paper
#
# Both examples come from a paper: I. Páczelt and Z. Mróz, "Numerical Analysis of Thermo-Mechanical Wear Problems for
# Reciprocal Punch Sliding". This notebook computes every number of the paper again, under several readings of its
# open data, and gives a verdict on each.
#
# The paper leaves open
#
# - the share $\kappa$ of the friction heat that enters the punch, and the debris' share $\gamma_d$;
# - whether the faces of the punch lose heat (the words can be read either way);
# - whether the conductance grows with pressure;
# - plane stress or strain, the strip's supports, and the heights of the hinges of Example 2;
# - the relaxation between heat and contact.
#
# Some 60 readings were tried, against seven numbers and descriptions. So keep apart the **fitted** and the
# **predicted**. A reading that meets a number it was fitted to says nothing. One of sixty that comes close to some
# number by chance says little.
#
# The computations live in `fenwear_verify.paper`; they take some minutes altogether. `python3 -m fenwear verify --only paper`
# writes the same comparison as a page.

# %%
# %matplotlib inline
import os

import matplotlib.pyplot as plt
import numpy as np
from IPython import display as show

from fenwear_verify.paper import READINGS, Scope, paper_figures, paper_rows, sensitivity_rows
from fenwear_verify.paper.section import map_text, markdown, readings_markdown
from fenwear_verify.paper.study import central_runs, heat_runs, stability_maps

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: coarser meshes, fewer readings
if COARSE:
    scope = Scope(
        settings=("geometry.degree=2", "geometry.parameters.elements_along_contact=8"),
        readings=(READINGS[0], READINGS[3]), cycles=2_000, variants=110, meshes=((8, 1), (8, 2)), steps=(5, 10),
        conductances=(0, 80), shares=(0.1, 0.3, 0.5),
    )  # fmt: skip
else:
    scope = Scope(meshes=((8, 4), (16, 4)), steps=(10, 5))  # each ends with the built-in case
for reading in scope.readings:
    print(f"{reading.name}: fitted {reading.fitted or 'nothing'}\n    {reading.command}")

# %% [markdown]
# ## Row by row
#
# A number is **reproduced** where ours agrees to one unit of the last digit printed under every reading. It is
# **reproduced under an assumption** where it agrees under one reading that keeps all of the paper's data. The
# verdicts are computed from the numbers; the reason names the fits.

# %%
rows = paper_rows(scope)
show.display(show.Markdown(markdown(rows)))

# %% [markdown]
# ## Readings side by side
#
# The paper has 47.16 K (one-way) and 50.11 K (at $n = 2200$). Its largest pressure falls after $n = 1800$, and it has
# 33.33 MPa at the centre of Example 2.

# %%
show.display(show.Markdown(readings_markdown(heat_runs(scope), central_runs(scope))))

# %% [markdown]
# Look at these:
#
# - **Round values** are the built-in cases: insulated faces, $\kappa = \gamma_d = 1/2$, everything else as printed, nothing
#   fitted. The two temperatures come out within 4 % and 1.5 %, the contact narrows and widens as described, and nothing
#   splits. The peak comes by $n = 250$, and Example 2 draws 51 MPa to its centre: these two do not fit.
# - **Fitted** to both temperatures are three. The first fits $\kappa$ and $\gamma_d$ at the printed conductance, the
#   second $\kappa$ and the conductance without debris. The third fits $\kappa$ and $\gamma_d$ with a conductance that
#   grows with pressure and is the printed one at the mean pressure. Two free values for two numbers: look at the other
#   columns.
# - **Text literal** loses heat through the faces. The punch then needs twice the heat for the same 47.16 K, the bulge runs
#   away, and the contact splits (notebook 3).
# - **Small face loss** without conductance: a ninth of the printed loss meets both temperatures. So insulated faces
#   are not the only way; small against the printed loss they must be.
# - **Literal sum** takes 47.16 K as the sum of both directions and the conductance as proportional to pressure. It gives
#   that number with nothing fitted, 47.42 K; but then the run stays at 34 K.
# - A late peak, or 33 MPa in Example 2, needs a departure from the paper's data. Such are a thermo-elastic response
#   **times 0.65**, a **friction arm** of 30 mm, $n$ counted in **steps of heat**; or the next one.
# - **Relaxed** takes the relaxation (29) from the pressure of the half-cycle before, by 0.001. The rule (30) ends the
#   iterations after two, because the gap hardly moves in them. The pressure that heats and wears then lags some 500
#   half-cycles behind the contact. The peak comes near $n = 1800$, to which the factor was chosen, and Example 2 has
#   38 MPa in place of 51. With all three values fitted it is the reading nearest to all numbers. But its pressures are
#   not those of the contact at that time. The course of the bulge would show the iteration, not the physics. Nothing in
#   the text says that the factor was so small.
#
# ## The map
#
# One figure explains the temperatures. Each is linear in the punch's share of the heat, so each is a line over the
# conductance; where the two lines meet, both fit. The course of a run there depends on the side of neutral stability.

# %%
for picture in paper_figures(scope):
    show.display(show.Markdown(f"**{picture.title}.** {picture.caption}"))
    show.display(picture.figure)
print(map_text(stability_maps(scope)))

# %% [markdown]
# The one-way temperature fixes $\kappa (1 - \gamma_d)$, the ratio of the two temperatures then fixes the conductance
# or $\gamma_d$. With insulated faces the lines meet right at neutral stability, near a share of 0.2. A run then takes
# thousands of half-cycles to forget its start, as in the paper. With faces that convect they lie where disturbances
# grow a hundredfold in a minute: that state exists, and no run stays in it.
#
# ## How exact are our own numbers?
#
# Before a difference to the paper means anything, ours must not depend on mesh, time step and coupling. Here they do not,
# to the digits of the table; time steps matter most. The width in contact is known to one node's weight, so to a
# millimetre or two.

# %%
choices, discretisations = sensitivity_rows(scope)
print(f"{'':42s} one-way  periodic     growth  at the end  narrowest  in the middle")
for variant in (*discretisations, *choices):
    print(f"{variant.name:42s} {variant.steady.monotonic:5.2f} K   {variant.steady.periodic:5.2f} K  "
          f"{variant.steady.growth:+.4f}/s     {variant.late:5.2f} K   {variant.narrowest:5.1f} mm   "
          f"{variant.peak:6.1f} MPa")  # fmt: skip

# %% [markdown]
# Look at these:
#
# - **Strip supports** change nothing that the table shows.
# - **Hinge heights** change the pressure in the middle of Example 2 by some MPa.
# - **Debris and share**: $\gamma_d$ up or $\kappa$ down by 0.1 do nearly the same. One temperature cannot separate the
#   two.
# - **Plane strain** makes the state less stable: the thermal strain out of the plane is held, which bulges the punch more.
# - A strip that **moves** under the punch, in five positions of its stroke of 3 mm, changes pressures by 2 % at most.
# - **Splitting** heat and contact as in the paper, from the contact one cycle ago, gives the same.
#
# ## When does the peak fall?
#
# The paper describes a peak that grows and falls again after half-cycle 1,800. Ours grows within some hundred
# half-cycles, as long as the composite needs to warm up, and then falls. Here is the ratio of the time scales: heat
# crosses a layer of thickness $h$ in about $h^2 / (2 a)$, with the diffusivity $a = k / (\rho c)$.

# %%
diffusivity = 5.0 / (846.0 * 1200.0) * 1e6  # composite, mm²/s
layer, half_cycle = 20.0, np.pi / 10
print(f"diffusion through the composite layer: {layer**2 / (2 * diffusivity) / half_cycle:.0f} half-cycles")

figure, ax = plt.subplots(figsize=(7, 3), layout="constrained")
for number, run in enumerate(heat_runs(scope)[:5]):
    ax.plot(run.half_cycle[1::2], run.middle_pressure[1::2] / run.mean, color=f"C{number}", label=run.reading.name,
            linestyle=("-", "--", "-.", ":", (0, (5, 1, 1, 1)))[number])  # fmt: skip
ax.axvline(1800, color="0.5", linewidth=0.8)
ax.set(xlabel="n", ylabel="over the mean (-)", title="Largest pressure on the middle two thirds, leftward half-cycles")
ax.set_ylim(bottom=0)
ax.legend(title="reading", frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
plt.show()

# %% [markdown]
# ## Summary
#
# - Everything that follows from equilibrium and the wear rule is reproduced: wear velocities, the pressure without heat,
#   equal mean fluxes.
# - Both temperatures and the described course agree where the faces lose little heat or none. Round values for the open
#   data give them within 4 % with nothing fitted, two fitted values give them exactly.
# - No reading that keeps the paper's data and solves heat and contact together reproduces the fall of the peak. None
#   reproduces the 33.33 MPa of Example 2. A relaxation that lags moves the first, and comes near the second.
#
# ## Your turn
#
# - `Scope(settings=("model.plane=strain",))`: the whole table in plane strain.
# - `Reading("mine", ("heat.partition=0.3", "heat.debris=0.2"))` from `fenwear_verify.paper`: your own reading, in
#   `Scope(readings=(*READINGS, mine))`.
