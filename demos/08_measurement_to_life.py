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
# # 8. From a measurement to a life
#
# Wear coefficients scatter from test to test by more than any model errs. A designer asks four questions. Which
# coefficient do my scars give, and how sure is it? What would change the answer most, and how long do parts live?
# Here three measured scars of a block that a ring has worn are **calibrated**. The result is **checked** on another
# condition, and turned into a **life with scatter**.
#
# The measurements: A. Cruzado, A. Zabala, M. A. Urchegui and X. Gómez, *Revista de Metalurgia* 46 (2010) 106-114, Fig.
# 12: 65 N on 6 mm, a ring of radius 20 mm, 3,600 m. The numbers are a part of those that I. Llavori digitised
# (LevelSetWear, BSD 3-Clause, © 2026 Iñigo Llavori, Mondragon Unibertsitatea); they come with fenwear.

# %%
# %matplotlib inline
import os

import matplotlib.pyplot as plt
import numpy as np

from fenwear import load_case
from fenwear.studies import (
    LeastSquares,
    Model,
    Unknown,
    between,
    calibrate,
    evaluate,
    lifetime,
    measured_folder,
    parse_quantity,
    parse_scatter,
    read_data,
    sensitivity,
)
from fenwear.studies.study_reports import life_figure, tornado

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements and samples
ELEMENTS, SAMPLES = (12, 6) if COARSE else (60, 100)

GREY, BLUE, RED = "#595959", "#0072B2", "#D55E00"
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": "medium"})

# %% [markdown]
# ## The case and the data
#
# The block is the body that stands still: fenwear's punch. Only the gap between the two bodies counts, and both are of
# steel, so that the ring's curvature is given to the block. A file of measurements names the unit of every column and
# the amount of sliding after which it was measured.

# %%
DATA = measured_folder()
case = load_case(DATA / "block_on_ring.toml", [f"geometry.parameters.elements_along_contact={ELEMENTS}"])
tests = [read_data(DATA / f"block_on_ring_{number}.csv", case) for number in (1, 2, 3)]
print((DATA / "block_on_ring_1.csv").read_text()[:620])

# %% [markdown]
# ## Is the model right? Depths that others have computed
#
# A published level-set model of this test has $K = 2 \cdot 10^{-9}$ mm²/N. Its scar is 16.155 µm deep after 800 m and
# 25.709 µm after 1,600 m. The worn area is $K P' s$ whatever the pressure, and a rigid ring would make the depth
# $(1.5\,R A)^{2/3} / (2 R)$.

# %%
model = Model(case)
for distance, published in ((800, 16.155), (1600, 25.709)):
    depth = 1e3 * evaluate(model, parse_quantity(f"largest_depth after {distance} m"), {})[0]
    area = 2e-9 * 65 / 6 * 1e3 * distance
    rigid = 1e3 * (1.5 * 20 * area) ** (2 / 3) / 40
    print(f"{distance:5} m: fenwear {depth:.3f} µm, published {published} µm, rigid {rigid:.3f} µm")

# %% [markdown]
# ## Calibrate each scar
#
# The unknowns are the coefficient and the offset of the trace. Neighbouring residuals are alike, since grooves are
# wider than the distance between two points. The files state this in the line `# scatter`, and the standard errors
# are wider.

# %%
found = [calibrate(case, [test], ["wear.punch.coefficient"], baseline=["offset"]) for test in tests]
figure, axes = plt.subplots(1, 3, figsize=(10, 3), sharey=True, layout="constrained")
for ax, one in zip(axes, found, strict=True):
    trace, k = one.traces[0], one.fitted[0]
    ax.plot(trace.series.x, -1e3 * trace.series.values, ".", color=GREY, label="measured")
    ax.plot(trace.series.x, -1e3 * trace.predicted, color=BLUE, label="fitted")
    ax.set_title(f"K = {1e9 * k.value:.3f} ± {1e9 * k.standard_error:.3f} · 10⁻⁹ mm²/N")
    ax.set_xlabel("x (mm)")
axes[0].set_ylabel("height (µm)")
axes[0].legend(frameon=False)
plt.show()
print(found[0].text())

# %% [markdown]
# The area of a scar alone gives $K = A / (P' s)$ without any model: a check of the fits. The three tests differ by more
# than their errors: that is the scatter between tests, and what a life has to live with.

# %%
for one, test in zip(found, tests, strict=True):
    series = test.series[0]
    depth = series.values - one.traces[0].offset
    area = ((depth[1:] + depth[:-1]) / 2) @ np.diff(series.x)
    print(f"from the profile {1e9 * one.fitted[0].value:.3f}, from the area {1e9 * area / (65 / 6 * 3.6e6):.3f}")
scatter = between(found)
print(*scatter.text)

# %% [markdown]
# ## What the data cannot tell
#
# Take the exponent $b$ of the pressure as a second unknown. All points of a scar are worn under one load, and so $K$
# and $b$ cannot both be known. The program reports this before anything is fitted; after a fit it gives no
# distribution of them.

# %%
both = [Unknown("wear.punch.coefficient"), Unknown("wear.punch.pressure_exponent")]
print(*LeastSquares(case, [tests[2]], both, baseline=["offset"]).cannot_tell())

# %% [markdown]
# ## Check on another condition
#
# There is no measurement at another load here, so **this one is made up**. It is the depth after 1,600 m at 130 N,
# from the model itself. The coefficient is drawn from the scatter, and a reading error of 1 µm is added. Check it as
# a real one: is it where the calibration expects it?

# %%
generator = np.random.default_rng(1)
drawn = float(np.exp(np.log(2e-9) + 0.12 * generator.standard_normal()))
check = ["punch.loads.0.force.1=-130"]
depth = parse_quantity("largest_depth after 1600 m")
measured = evaluate(model, depth, {"wear.punch.coefficient": drawn}, check)[0] + 1e-3 * generator.standard_normal()
low, middle, high = scatter.marginals[0].ppf([0.025, 0.5, 0.975])
expected = [1e3 * evaluate(model, depth, {"wear.punch.coefficient": k}, check)[0] for k in (low, middle, high)]
print(f"made-up measurement {1e3 * measured:.1f} µm; expected {expected[1]:.1f} µm, "
      f"95 % from {expected[0]:.1f} to {expected[2]:.1f} µm")  # fmt: skip

# %% [markdown]
# ## What changes the depth most
#
# Derivatives by differences of runs with the same jumps, each with its own error. The bars: the depth with each key a
# tenth smaller and larger.

# %%
keys = ["wear.punch.coefficient", "punch.loads.0.force.1", "geometry.parameters.radius", "materials.steel.young"]
depths = sensitivity(case, ["largest_depth after 3600 m"], keys)
print(depths[0].text())
tornado(depths)

# %% [markdown]
# For a scar between rigid bodies the depth is proportional to $K^{2/3}$, $P'^{2/3}$ and $R^{-1/3}$, and does not
# depend on the modulus. The radius is rounded by the mesh generator's steps, and its error is larger.
#
# ## Life with scatter
#
# Blocks slide until the scar is 0.03 mm deep. The coefficient scatters as between the three tests, and the load by 10
# %. Quantiles have the interval that holds them with 95 %.

# %%
inputs = scatter.and_also(parse_scatter(case, "punch.loads.0.force.1=normal(-65 N, 10 %)"))
life = lifetime(case, "distance until largest_depth 0.03 mm", inputs, samples=SAMPLES, wanted=1.2e6)
print(life.text())
life_figure(life)

# %% [markdown]
# For rigid bodies $s \propto 1 / (K P')$, so that the variance of $\ln s$ is the sum of those of $\ln K$ and $\ln P'$.
#
# On the command line, in the folder that `measured_folder()` names, the same is:
#
#     fenwear calibrate block_on_ring.toml block_on_ring_*.csv --unknown wear.punch.coefficient --baseline offset \
#         --each -o rings
#     fenwear sensitivity block_on_ring.toml --of "largest_depth after 3600 m" --to wear.punch.coefficient --to contact.friction
#     fenwear life block_on_ring.toml --until "distance until largest_depth 0.03 mm" --from rings \
#         --scatter "punch.loads.0.force.1=normal(-65 N, 10 %)" -o lives
