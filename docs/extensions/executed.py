"""Executes the notebooks of demos/, so that their pages show what they print and draw.

They run side by side, one on each core, the long ones first, and into docs/notebooks. What was executed stays valid
until a notebook, the package or a mesh changes. This is the notebooks' test, too: a cell that fails or warns, a figure
that is not drawn and a file left behind end the build.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Empty
from typing import Any

import nbformat
from jupyter_client.asynchronous import AsyncKernelClient
from jupyter_client.channels import AsyncZMQSocketChannel
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from sphinx.errors import ExtensionError
from sphinx.util import logging

ROOT = Path(__file__).parents[2]
VERIFICATION = ROOT / "tests" / "verification"
DEMOS, PAGES = ROOT / "demos", ROOT / "docs" / "notebooks"
SECONDS = 1800  # ends what hangs, however busy the machine
# Those that take minutes, as their tests run them: a coarse mesh, fewer variants. A note on the page says so.
LONG = {"06_the_paper", "08_measurement_to_life"}
NOTE = (
    "> **On this page** the notebook was executed with fewer elements and variants, to be made in seconds. Its figures"
    " and tables are rougher than those that the text speaks of, which you see when you execute it yourself."
)
KEY = "fenwear_key"
WIDGET = "application/vnd.jupyter.widget-"


class _Channel(AsyncZMQSocketChannel):  # type: ignore[misc]
    """Asks anew every second: asyncio can miss that a message has come, which then lies there until the timeout."""

    async def get_msg(self, timeout: float | None = None) -> dict[str, Any]:
        """Return the next message, within so many seconds."""
        end = math.inf if timeout is None else time.monotonic() + timeout
        while True:
            left = end - time.monotonic()
            try:
                return await super().get_msg(min(1.0, max(0.0, left)))
            except Empty:
                if left <= 1.0:
                    raise


class _Client(AsyncKernelClient):  # type: ignore[misc]
    shell_channel_class = iopub_channel_class = control_channel_class = _Channel


class _Manager(AsyncKernelManager):  # type: ignore[misc]
    client_factory = _Client


def _code() -> bytes:
    """Return a checksum of what any notebook may use."""
    found = hashlib.sha256(Path(__file__).read_bytes())
    for path in sorted([*(ROOT / "fenwear").rglob("*"), *VERIFICATION.rglob("*.py"), *(ROOT / "meshes").glob("*")]):
        if path.is_file() and "__pycache__" not in path.parts:
            found.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return found.digest()


def code_key() -> str:
    """Return a checksum of what any notebook or experiment may use."""
    return hashlib.sha256(_code()).hexdigest()


def _kept(page: Path) -> str:
    """Return the key under which a notebook was executed, or nothing."""
    try:
        return str(json.loads(page.read_text("utf-8"))["metadata"][KEY])
    except (OSError, ValueError, KeyError):
        return ""


def _outputs(notebook: Any) -> Iterator[tuple[int, Any]]:
    for at, cell in enumerate(notebook.cells):
        for output in cell.get("outputs", []):
            yield at, output


def _join_streams(notebook: Any) -> None:
    """Put what a cell prints bit by bit together."""
    for cell in notebook.cells:
        joined: list[Any] = []
        for output in cell.get("outputs", []):
            if joined and output.output_type == "stream" == joined[-1].output_type:
                joined[-1].text += output.text
            else:
                joined.append(output)
        if "outputs" in cell:
            cell.outputs = joined


def _stand_still(notebook: Any) -> None:
    """Put what sliders show at their start in the sliders' place: moving them takes a kernel."""
    kept = notebook.metadata.pop("widgets", {}).get(f"{WIDGET}state+json", {}).get("state", {})
    shown = [output for model in kept.values() for output in model["state"].get("outputs", [])]
    for cell in notebook.cells:
        if any(f"{WIDGET}view+json" in output.get("data", {}) for output in cell.get("outputs", [])):
            cell.outputs = [nbformat.from_dict(output) for output in shown]


def _failed(path: Path, what: str) -> ExtensionError:
    plain = re.sub(r"\x1b\[[0-9;]*m", "", what)
    return ExtensionError(f"{path.relative_to(ROOT)}: {plain}")


def execute(path: Path, key: str) -> None:
    """Execute a notebook in a folder of its own and write it among the pages.

    Raises:
        ExtensionError: a cell failed or wrote to standard error, a figure is missing, or a file was left behind.
    """
    notebook = nbformat.read(path, as_version=4)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": f"{ROOT}:{VERIFICATION}"}
    if path.stem in LONG:
        environment["FENWEAR_DEMO_COARSE"] = "1"
        notebook.cells.insert(1, nbformat.v4.new_markdown_cell(NOTE))
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            notebook,
            timeout=SECONDS,
            kernel_name="python3",
            kernel_manager_class=_Manager,
            resources={"metadata": {"path": folder}},
        )
        try:
            client.execute(env=environment)
        except CellExecutionError as error:
            raise _failed(path, str(error)) from error
        if left := os.listdir(folder):
            raise _failed(path, f"leaves {', '.join(left)} behind")
    figures = sum("image/png" in output.get("data", {}) for _, output in _outputs(notebook))
    expected = sum(cell.source.count("plt.show()") for cell in notebook.cells if cell.cell_type == "code")
    if not figures >= expected > 0:
        raise _failed(path, f"draws {figures} figures, and shows {expected}")
    for at, output in _outputs(notebook):
        if output.output_type == "stream" and output.name == "stderr":
            raise _failed(path, f"cell {at} writes to standard error:\n{output.text}")
    _join_streams(notebook)
    _stand_still(notebook)
    notebook.metadata[KEY] = key
    nbformat.write(notebook, PAGES / path.name)


def write(app: Any) -> None:
    """Put the executed notebooks beside the pages."""
    PAGES.mkdir(exist_ok=True)
    code, due = _code(), []
    names = {path.name for path in DEMOS.glob("*.ipynb")}
    for page in PAGES.glob("*.ipynb"):
        if page.name not in names:
            page.unlink()
    for path in sorted(DEMOS.glob("*.ipynb"), key=lambda p: p.stem not in LONG):
        key = hashlib.sha256(code + path.read_bytes()).hexdigest()
        if _kept(PAGES / path.name) != key:
            due.append((path, key))
    if not due:
        return
    logging.getLogger(__name__).info("executing %d notebooks", len(due))
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for done in [pool.submit(execute, *each) for each in due]:
            done.result()


def setup(app: Any) -> dict[str, bool]:
    """Sphinx asks for it."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
