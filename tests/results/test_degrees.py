"""Results in degrees Celsius where the case has degrees Celsius."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray

from fenwear import load_case, read_history
from fenwear.case import changed_case
from fenwear.report.figures import all_figures
from fenwear.report.run_figures import temperature_unit
from fenwear.results.export import export
from fenwear.results.quantity import ICE, in_kelvin
from fenwear.studies.run import run_case

SMALL = (
    "geometry.degree=1",
    "geometry.parameters.elements_along_contact=4",
    "run.half_cycles=4",
    "output.report=false",
    "output.uncertainty=false",
)
CELSIUS = tuple(
    f"{key}='20 degC'"
    for key in ("heat.ambient", "heat.initial", "strip.temperatures.0.temperature", "strip.temperatures.1.temperature")
)
KELVIN = tuple(one.replace("20 degC", "293.15 K") for one in CELSIUS)


def test_everything_written_is_in_degrees(tmp_path: Path) -> None:
    """The same case in degrees and in kelvin: history, summary, fields, export and figures differ by the scale."""
    summaries, histories = [], []
    for name, settings in {"degrees": CELSIUS, "kelvin": KELVIN}.items():
        case = load_case("example1-heat", [*SMALL, *settings])
        assert case.in_degrees == (name == "degrees")
        assert changed_case(case, "contact.friction=0.2").in_degrees == (name == "degrees")
        told: list[str] = []
        summary, folder = run_case(case, name, tmp_path / name, told.append)
        summaries.append(summary)
        histories.append(read_history(folder))
        export(folder)
    degrees, kelvin = histories
    warm = [name for name in kelvin.data_vars if kelvin[name].attrs["units"] == "K"]
    assert set(warm) == {"temperature_punch", "temperature_strip", "largest_temperature"}
    for name in warm:
        assert degrees[name].attrs["units"] == "degC"
        np.testing.assert_allclose(degrees[name] + ICE, kelvin[name], rtol=1e-12)
        np.testing.assert_allclose(in_kelvin(degrees)[name], kelvin[name], rtol=1e-12)
    assert temperature_unit(degrees) == "°C"
    assert summaries[0]["largest_temperature_degC"] + ICE == pytest.approx(
        summaries[1]["largest_temperature_K"], rel=1e-12
    )
    fields = [
        xarray.open_dataset(next((tmp_path / name / "fields").glob("*.nc")), engine="h5netcdf")
        for name in ("degrees", "kelvin")
    ]
    assert fields[0].punch_temperature.attrs["units"] == "degC"
    np.testing.assert_allclose(fields[0].punch_temperature + ICE, fields[1].punch_temperature, rtol=1e-12)
    assert "degC" in (tmp_path / "degrees" / "export" / "history.csv").read_text()
    labels = [ax.get_ylabel() for figure in all_figures(degrees).values() for ax in figure.axes]
    assert "largest temperature (°C)" in labels
    assert not any("(K)" in label for label in labels)


def test_a_run_goes_on_in_its_degrees(tmp_path: Path) -> None:
    """Resumed with the resolved case, which is in kelvin, the history stays in degrees."""
    run_case(load_case("example1-heat", [*SMALL, *CELSIUS]), "run", tmp_path / "run", lambda message: None)
    resolved = load_case(tmp_path / "run" / "case.toml", ["run.half_cycles=6"])
    assert not resolved.in_degrees
    run_case(resolved, "run", tmp_path / "run", lambda message: None, resume=True)
    history = read_history(tmp_path / "run")
    assert history.largest_temperature.attrs["units"] == "degC"
    assert float(history.largest_temperature.max()) < 100
    assert (np.diff(history.largest_temperature) > 0).all()
