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
# # 4. Several processes, and resuming a run
#
# Long runs are started from the command line, often on several processes (MPI ranks), and they get interrupted. Here
# you start fenwear on two processes, stop half way, and resume from the checkpoint. Then you check that the numbers
# are those of one uninterrupted run on one process.
#
# The case is Example 1 with heat and $\kappa = 0.2$ on a small mesh: the checkpoint then holds temperatures too.

# %%
# %matplotlib inline
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray

COARSE = os.environ.get("FENWEAR_DEMO_COARSE") == "1"  # set by the docs build: fewer elements, fewer half-cycles
half, whole = (10, 20) if COARSE else (300, 600)  # half-cycles
settings = [
    "geometry.degree=2",
    f"geometry.parameters.elements_along_contact={6 if COARSE else 16}",
    "heat.partition=0.2",
    "output.fields_at=[]",  # no fields of the bodies and
    "output.report=false",  # no figures here
]
temporary = tempfile.TemporaryDirectory()
folder = Path(temporary.name)

# %% [markdown]
# ## Starting it
#
# In a shell you would type
#
# ```sh
# mpirun -n 2 python3 -m fenwear run example1-heat -o results/two --set run.half_cycles=300
# ```
#
# The function below does the same from Python. Each process uses one thread. The function allows more processes than
# processor cores, so that the notebook works on any machine. A process that waits leaves its core to the others. For
# speed, start as many processes as there are cores, or fewer.

# %%
environment = {
    **os.environ,
    "OMP_NUM_THREADS": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",  # Open MPI 5
    "OMPI_MCA_rmaps_base_oversubscribe": "1",  # Open MPI 4
    "OMPI_MCA_mpi_yield_when_idle": "1",
}


def run(output, half_cycles, *options, ranks=1, extra=()):
    """Run the case in a process of its own, or in several; return the finished process."""
    start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    sets = [f"--set={setting}" for setting in (*settings, f"run.half_cycles={half_cycles}", *extra)]
    command = [*start, sys.executable, "-m", "fenwear", "run", "example1-heat", "-o", str(output), *options, *sets]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)


def show(done):
    """Print what the program said, and end here if it failed unexpectedly."""
    print(f"exit status {done.returncode}\n{done.stderr.strip()}")
    if done.returncode:
        raise SystemExit(f"the run failed\n{done.stdout}\n{done.stderr}")


# %% [markdown]
# First the reference: one process, all half-cycles.

# %%
show(run(folder / "one", whole))

# %% [markdown]
# Now two processes, half of the half-cycles.

# %%
show(run(folder / "two", half, ranks=2))
print("checkpoint:", ", ".join(path.name for path in (folder / "two").glob("checkpoint*")))

# %% [markdown]
# ## Resume
#
# `--resume` with the same case and the same folder continues from the checkpoint, here to twice as many half-cycles.
# The number of processes may change from one start to the next: now it is one.
#
# A run writes a checkpoint every minute (`output.checkpoint`) and at its end. It also writes one when it gets an
# interrupt (Ctrl-C, or the signal TERM of a batch system). So a run that is killed loses little more than a minute.

# %%
show(run(folder / "two", whole, "--resume"))

# %% [markdown]
# ## The same numbers?
#
# xarray opens the histories and lines them up by half-cycle and position.

# %%
names = {"one": "one process", "two": "two processes, then resumed on one"}
histories = {name: xarray.open_dataset(folder / name / "history.nc", engine="h5netcdf").load() for name in names}
reference, resumed = histories["one"], histories["two"]
scales = {
    "pressure": float(reference.pressure.isel(half_cycle=-1).mean()),
    "wear": float(reference.wear.max()),
    "temperature_punch": float(reference.temperature_punch.max()),
}
assert (resumed.half_cycle == reference.half_cycle).all()
for variable, scale in scales.items():
    difference = float(np.abs(resumed[variable] - reference[variable]).max() / scale)
    print(f"largest difference of {variable:18} {difference:.1e} of {scale:.3g} {reference[variable].units}")
    assert difference < 1e-6

# %%
figure, axes = plt.subplots(2, 1, figsize=(7, 5.6), sharex=True, layout="constrained")
for ax, variable, label in zip(
    axes,
    ("largest_pressure", "largest_temperature"),
    ("largest pressure (MPa)", "largest temperature (K)"),
    strict=True,
):
    rightward = {name: history.isel(half_cycle=slice(0, None, 2)) for name, history in histories.items()}
    ax.plot(rightward["one"].half_cycle, rightward["one"][variable], color="#56B4E9", linewidth=6, label=names["one"])
    ax.plot(rightward["two"].half_cycle, rightward["two"][variable], "--", color="0", label=names["two"])
    ax.axvline(half + 0.5, color="#D55E00", linewidth=1, label="interrupted here")
    ax.set_ylabel(label)
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_ylim(bottom=0)
axes[0].legend(frameon=False)
axes[0].set_title("Both runs, strip moves rightward", loc="left", fontsize="medium")
axes[1].set_xlabel("half-cycle")
plt.show()

# %% [markdown]
# They agree to rounding: the order in which numbers are added up differs with the number of processes. Where a contact
# is as unstable as in `example1-heat-unstable` (notebook 3), late in a run even rounding grows. Then compare statistics,
# not single values.
#
# ## A checkpoint of another case
#
# `--resume` continues the same problem only. If something that matters was changed, it names the change and stops.

# %%
refused = run(folder / "two", 2 * whole, "--resume", extra=("contact.friction=0.3",))
print(f"exit status {refused.returncode}\n{refused.stderr.strip()}")
assert refused.returncode == 2

# %% [markdown]
# ## When do several processes help?
#
# Meshes, factors and full temperature fields are distributed, so large meshes fit and are set up faster. The contact
# itself is small, and every process holds it: half-cycles do not get faster. For a mesh like the one here one process
# is best. To sweep a parameter, start several runs side by side instead, or use `Tribosystem.vary` (notebook 2).

# %%
temporary.cleanup()
