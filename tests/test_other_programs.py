"""Programs that fenwear works with, where pip installs them: `docker/fenwear test --wheel` has them all."""

from __future__ import annotations

import multiprocessing
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import load_case, sweep
from fenwear.files.height_maps import read_heights
from fenwear.studies import Forward, forward

KEYS = ["wear.punch.coefficient", "contact.friction"]
AT, PORT = [4e-8, 0.25], 42421


@pytest.fixture(scope="module")
def model() -> Forward:
    case = load_case("example1", ["geometry.degree=1", "geometry.parameters.elements_along_contact=8"])
    return forward(case, ["steady worn_volume_increment"], KEYS)


def serve(value: float) -> None:
    import umbridge

    class Wear(umbridge.Model):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__("forward")

        def get_input_sizes(self, config: Any) -> list[int]:
            return [len(KEYS)]

        def get_output_sizes(self, config: Any) -> list[int]:
            return [1]

        def supports_evaluate(self) -> bool:
            return True

        def __call__(self, parameters: Any, config: Any) -> list[list[float]]:
            return [[value * parameters[0][0] / AT[0]]]

    umbridge.serve_models([Wear()], PORT)


def test_umbridge_client_reads_the_model(model: Forward) -> None:
    """The client of UM-Bridge gets through its server what Python gets; the volume is linear in the coefficient."""
    umbridge = pytest.importorskip("umbridge")
    value = float(model.values(AT)[0])
    process = multiprocessing.get_context("spawn").Process(target=serve, args=(value,), daemon=True)
    process.start()
    try:
        for _ in range(600):
            try:
                client = umbridge.HTTPModel(f"http://localhost:{PORT}", "forward")
                break
            except Exception:  # it is not there yet
                time.sleep(0.1)
        assert client.get_input_sizes() == [2]
        assert client([[2 * AT[0], AT[1]]])[0][0] == pytest.approx(float(model.values([2 * AT[0], AT[1]])[0]), rel=1e-9)
    finally:
        process.terminate()
        process.join()


def test_openturns_function_has_the_jacobian(model: Forward) -> None:
    """A function of OpenTURNS with fenwear's Jacobian: its gradient is that of differences."""
    openturns = pytest.importorskip("openturns")

    def gradient(x: Any) -> Any:
        return np.transpose(model.jacobian(list(x))).tolist()

    function = openturns.PythonFunction(2, 1, lambda x: list(map(float, model.values(list(x)))), gradient=gradient)
    assert function(AT)[0] == pytest.approx(float(model.values(AT)[0]), rel=1e-12)
    found = np.array(openturns.Function(function).gradient(AT))[:, 0]
    assert found[0] == pytest.approx(function(AT)[0] / AT[0], rel=1e-6)  # proportional
    assert abs(found[1]) < 1e-6 * function(AT)[0]  # whatever friction is, the volume is k F s


def test_surface_topography_reads_a_map(tmp_path: Path) -> None:
    """Heights on a raster in an instrument's format (SDF of ISO 25178-71, in m) come back in mm."""
    pytest.importorskip("SurfaceTopography")
    heights = np.arange(24).reshape(4, 6) % 7  # µm: profiles along x one after the other
    head = {"ManufacID": "fenwear", "CreateDate": "010120260000", "ModDate": "010120260000", "NumPoints": 6,
            "NumProfiles": 4, "Xscale": 5e-7, "Yscale": 1e-6, "Zscale": 1e-6, "Zresolution": -1, "Compression": 0,
            "DataType": 7, "CheckType": 0}  # fmt: skip
    text = ["aISO-1.0", *(f"{key} = {value}" for key, value in head.items()), "*", *map(str, heights.ravel()), "*"]
    path = tmp_path / "map.sdf"
    path.write_text("\n".join(text), "utf-8")
    found = read_heights(path)
    assert [len(axis) for axis in found.places] == [6, 4]
    assert np.ptp(found.heights) == pytest.approx(6e-3, rel=1e-9)
    assert np.diff(found.places[0])[0] == pytest.approx(5e-4, rel=1e-9)


def test_a_sweep_on_dask(tmp_path: Path) -> None:
    """A local cluster of dask computes the rows that this process computes alone."""
    distributed = pytest.importorskip("distributed")
    case = load_case("example1", ["geometry.degree=1", "geometry.parameters.elements_along_contact=8"])
    over = {"contact.friction": [0.1, 0.2, 0.25]}
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=tmp_path
    )
    with distributed.Client(cluster).get_executor() as executor:
        found = sweep(case, over, executor=executor, folder=tmp_path / "out")
    np.testing.assert_array_equal(found.pressure, sweep(case, over).pressure)
