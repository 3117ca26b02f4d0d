"""What is left of cycles that are tables: ways, tracks and cross-shear of a ball in its cup, and their picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fenwear import load_case
from fenwear.report.maps import has_tracks, tracks_figure
from fenwear.results.stored_history import load_history
from fenwear.studies.run import run_case

SMALL = ("geometry.parameters={radius=14, clearance=0.1, contact_angle=60, across=4, around=2, cup_layers=1, "
         "ball_layers=1}", "geometry.degree=2", "run.half_cycles=2", "run.integration='explicit'",
         "output.report=false", "output.fields_at=[]")  # fmt: skip


def test_tracks_and_cross_shear(tmp_path: Path) -> None:
    """Tracks are closed and stay on the ball, their steps are the ways; the tensor of work is told at every node."""
    summary, folder = run_case(load_case("ball-in-cup", SMALL), "test", tmp_path / "run", lambda message: None)
    history = load_history(folder)
    track, slid = history.track.values, history.slid.values
    nodes = np.column_stack([history[axis].values for axis in "xyz"])
    assert track.shape == (33, len(nodes), 3)
    np.testing.assert_allclose(track[[0, -1]], [nodes, nodes], atol=1e-9)
    away = np.linalg.norm(track, axis=2)
    np.testing.assert_allclose(away, np.broadcast_to(away[0], away.shape), rtol=1e-9)
    # The first step of a track is what slides there, to second order in a step and the first in the clearance.
    np.testing.assert_allclose(track[1] - track[0], slid[0], atol=0.03 * np.abs(slid[0]).max())
    assert np.linalg.norm(slid, axis=2).sum(axis=0).max() == pytest.approx(
        summary["sliding"]["largest_way_of_cycle_mm"]
    )
    last = history.isel(half_cycle=-1)
    way = np.column_stack([last[f"principal_{axis}"].values for axis in "xyz"])
    np.testing.assert_allclose(np.linalg.norm(way, axis=1), 1, rtol=1e-9)
    assert ((last.cross_shear >= 0) & (last.cross_shear <= 0.5)).all()
    work = summary["punch"]["largest_cross_shear"]
    assert float(last.cross_shear.where(last.dissipated_energy > 0.05 * last.dissipated_energy.max(), 0).max()) <= (
        work + 1e-9
    )
    picture = tracks_figure(history)
    assert [ax.get_title(loc="left") for ax in picture.axes[:2]] == [
        "tracks over a cycle",
        "cross-shear and main direction",
    ]
    assert has_tracks(history)
    assert not has_tracks(history.drop_vars("track"))
