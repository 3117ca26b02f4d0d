"""The notebooks of demos/: made from their scripts, and every cell runs on a coarse setting."""

from __future__ import annotations

import math
import os
import shutil
import time
from pathlib import Path
from queue import Empty
from typing import Any

import pytest

jupytext = pytest.importorskip("jupytext")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")
asynchronous, channels, manager = (
    pytest.importorskip(f"jupyter_client.{name}") for name in ("asynchronous", "channels", "manager")
)

ROOT = Path(__file__).parents[1]
DEMOS = ROOT / "demos"
NAMES = [
    "01_first_tour",
    "02_steady_state",
    "03_heat_and_instability",
    "04_mpi_and_restart",
    "05_own_material_and_geometry",
    "06_the_paper",
    "07_fretting",
    "08_measurement_to_life",
    "09_solids",
    "10_partial_slip",
]
SECONDS = 1800  # ends what hangs, however busy the machine


class _Channel(channels.AsyncZMQSocketChannel):
    """Asks anew every second: asyncio can miss that a message has come, which then lies there until the timeout."""

    async def get_msg(self, timeout: float | None = None) -> dict[str, Any]:
        end = math.inf if timeout is None else time.monotonic() + timeout
        while True:
            left = end - time.monotonic()
            try:
                return await super().get_msg(min(1.0, max(0.0, left)))
            except Empty:
                if left <= 1.0:
                    raise


class _Client(asynchronous.AsyncKernelClient):
    shell_channel_class = iopub_channel_class = control_channel_class = _Channel


class _Manager(manager.AsyncKernelManager):
    client_factory = _Client


def _cells(notebook: Any) -> list[tuple[str, str]]:
    return [(cell.cell_type, cell.source) for cell in notebook.cells]


def _report(name: str, notebook: Any, error: Exception) -> str:
    """Return the failed cell with what it and all before it printed."""
    lines = [f"{name}.ipynb: {error}"]
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            if output.output_type == "stream":
                lines.append(output.text.rstrip())
            elif output.output_type == "error":
                lines += ["", "cell:", cell.source, "", f"{output.ename}: {output.evalue}"]
    return "\n".join(lines)


def test_names() -> None:
    """Every script has its notebook, and none is left out here."""
    assert sorted(p.stem for p in DEMOS.glob("[0-9]*.py")) == NAMES
    assert sorted(p.stem for p in DEMOS.glob("*.ipynb")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_notebook_is_made_from_its_script(name: str) -> None:
    """The same cells in both, and nothing executed: jupytext --to notebook demos/*.py brings them together."""
    script, notebook = (jupytext.read(DEMOS / f"{name}{suffix}") for suffix in (".py", ".ipynb"))
    assert _cells(notebook) == _cells(script)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells)


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.ranks] * n.startswith("04")) for n in NAMES])
def test_notebook_runs(name: str, tmp_path: Path) -> None:
    """Every cell runs without a display, draws its figures, and leaves nothing behind."""
    if name.startswith("04") and shutil.which("mpirun") is None:
        pytest.skip("mpirun is missing")
    notebook = jupytext.read(DEMOS / f"{name}.ipynb")
    client = nbclient.NotebookClient(
        notebook,
        timeout=SECONDS,
        kernel_name="python3",
        kernel_manager_class=_Manager,
        resources={"metadata": {"path": str(tmp_path)}},
    )
    # The session's own MPI must not show through to the kernel and the processes that it starts.
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PMIX", "PRTE_", "OMPI_COMM", "OMPI_FILE"))}
    environment |= {"FENWEAR_DEMO_COARSE": "1", "OMP_NUM_THREADS": "1"}
    environment["PYTHONPATH"] = os.pathsep.join([str(ROOT), *os.environ.get("PYTHONPATH", "").split(os.pathsep)])
    environment.pop("DISPLAY", None)
    environment.pop("FENWEAR_KEPT_GIB", None)  # as for a reader, set-ups are kept
    try:
        client.execute(env=environment)
    except Exception as error:
        pytest.fail(_report(name, notebook, error), pytrace=False)
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    figures = [output for output in outputs if "image/png" in output.get("data", {})]
    sources = "".join(source for kind, source in _cells(notebook) if kind == "code")
    assert len(figures) >= sources.count("\nplt.show()") > 0
    assert not list(tmp_path.iterdir())
    noise = [o.text for o in outputs if o.output_type == "stream" and o.name == "stderr"]
    assert not noise, noise
