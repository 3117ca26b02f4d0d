"""One picture of the contact surface that can be turned and zoomed in a browser, without a network.

plotly's own script goes into the page, compressed: the browser unpacks it. Arrays are there as their bytes, in single
precision, which takes less time and room than their digits. Rings are shown as they are, turned about their axis.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import xarray
from markupsafe import Markup
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.report.maps import Quantity, quantities
from fenwear.report.shown import pressure_top
from fenwear.report.surface import model_of, surface_of
from fenwear.stack import without

AROUND = 72  # parts of a ring
RAISED = 0.15  # of the surface's size: the largest worn depth as it is drawn
COLOURS = {"YlGnBu": "YlGnBu", "YlOrBr": "YlOrBr", "YlOrRd": "YlOrRd"}
HEIGHT = 560  # pixels


@dataclass(frozen=True)
class Turned:
    """A part of a page that runs a script.

    Attributes:
        html: The part.
        nonce: By which the page's policy knows the script for its own; no other may run.
    """

    html: Markup
    nonce: str


def turned_map(history: xarray.Dataset, half_cycles: Sequence[int]) -> Turned:
    """Return worn surfaces, coloured by pressure, worn depth or temperature at each half-cycle.

    Raises:
        ImportError: plotly is missing.
        OSError: its script is.
    """
    # json.dumps leaves "</" alone, which would end a script.
    data = json.dumps(turned_figure(history, half_cycles), separators=(",", ":"), allow_nan=False)
    data = data.replace("<", "\\u003c")
    packed = _packed_script()
    nonce = hashlib.sha256(data.encode()).hexdigest()[:32]
    html = Markup(_PAGE).format(height=HEIGHT, nonce=nonce, data=Markup(data), script=Markup(packed))
    return Turned(html, nonce)


@lru_cache(maxsize=1)
def _packed_script() -> str:
    with without("IPython"):  # plotly would load it to draw in notebooks
        from plotly.offline import get_plotlyjs  # where distributions have put it

    # The lowest level that makes use of lazy matching: a higher one saves 6 % in twice the time.
    return base64.b64encode(gzip.compress(get_plotlyjs().encode(), compresslevel=4, mtime=0)).decode()


def turned_figure(history: xarray.Dataset, half_cycles: Sequence[int]) -> dict[str, Any]:
    """Return the figure as plotly takes it: a mesh for each quantity, a button for each, a slider over half-cycles."""
    import plotly.graph_objects as go

    shown = list(quantities(history).values())
    last = [_mesh(history, quantity, half_cycles) for quantity in shown]
    for k, trace in enumerate(last):
        trace.visible = k == 0
    figure = go.Figure(data=last, layout=_layout(shown, half_cycles))
    found: dict[str, Any] = json.loads(figure.to_json())
    surfaces = {body: _corners(history, body) for body in {quantity.body for quantity in shown}}
    for drawn, quantity in zip(found["data"], shown, strict=True):  # plotly would look at every number by itself
        drawn.update(surfaces[quantity.body])
        drawn["z"] = packed(_raised(history, quantity.body, half_cycles[-1]))
        drawn["intensity"] = packed(_values(history, quantity, half_cycles[-1]))
    # What changes from half-cycle to half-cycle alone, so that the chosen quantity stays.
    for step, n in zip(found["layout"]["sliders"][0]["steps"], half_cycles, strict=True):
        heights = {body: packed(_raised(history, body, n)) for body in {quantity.body for quantity in shown}}
        values = [packed(_values(history, quantity, n)) for quantity in shown]
        step["args"] = [{"z": [heights[quantity.body] for quantity in shown], "intensity": values}]
    return found


def _layout(shown: Sequence[Quantity], half_cycles: Sequence[int]) -> dict[str, Any]:
    pick = [
        {"label": q.title, "method": "update", "args": [{"visible": [other is q for other in shown]}]} for q in shown
    ]
    steps = [{"label": f"{n:,}", "method": "restyle", "args": [{}]} for n in half_cycles]
    slider = {
        "steps": steps,
        "active": len(half_cycles) - 1,
        "currentvalue": {"prefix": "half-cycle "},
        "pad": {"b": 30, "l": 10, "r": 20},
    }
    return {
        "height": HEIGHT,
        "margin": {"l": 0, "r": 0, "t": 50, "b": 20},
        "updatemenus": [{"buttons": pick, "x": 0, "y": 1.1, "xanchor": "left", "yanchor": "top"}],
        "sliders": [slider],
        "scene": {
            "aspectmode": "data",
            "xaxis": {"title": "x (mm)"},
            "yaxis": {"title": "y (mm)"},
            "zaxis": {"title": "z, worn depth raised", "showticklabels": False},
            "camera": {"eye": {"x": 1.2, "y": -1.7, "z": 1.1}},
        },
    }


def _mesh(history: xarray.Dataset, quantity: Quantity, half_cycles: Sequence[int]) -> Any:
    """Return a mesh without its numbers, coloured by a quantity from its least to its largest value."""
    import plotly.graph_objects as go

    values = quantity.factor * history[quantity.variable]
    low, high = float(values.min()), float(values.max())
    if quantity.variable == "pressure":
        low, high = 0.0, min(high, pressure_top(history, half_cycles))
    return go.Mesh3d(
        cmin=low, cmax=high if high > low else low + 1.0, colorscale=COLOURS[quantity.colours],
        colorbar={"title": quantity.unit, "len": 0.7}, name=quantity.title, showscale=True,
        hovertemplate=f"%{{intensity:.4g}} {quantity.unit}<br>x = %{{x:.4g}} mm, y = %{{y:.4g}} mm",
        lighting={"ambient": 0.75, "diffuse": 0.5, "specular": 0.05},
    )  # fmt: skip


def _corners(history: xarray.Dataset, body: str) -> dict[str, dict[str, str]]:
    """Return where the points of a surface lie in its plane, and the corners of its triangles."""
    x, triangles, _ = _solid_or_rings(history, body)
    return {"x": packed(x[:, 0]), "y": packed(x[:, 1])} | {
        name: packed(corner, "<i4") for name, corner in zip("ijk", triangles.T, strict=True)
    }


def _raised(history: xarray.Dataset, body: str, half_cycle: int) -> Array:
    """Return the heights of a worn surface as they are drawn: seen from the gap, what is worn off is a hollow."""
    x, _, repeat = _solid_or_rings(history, body)
    end = "_strip" if body == "strip" else ""
    depth, most = history[f"wear{end}"].sel(half_cycle=half_cycle).values, float(history[f"wear{end}"].max())
    scale = RAISED * float(np.ptp(x, axis=0).max()) / most if most > 0 else 0.0
    return np.asarray(x[:, 2] - scale * np.tile(depth, repeat))


def _values(history: xarray.Dataset, quantity: Quantity, half_cycle: int) -> Array:
    """Return what colours a surface at a half-cycle."""
    _, _, repeat = _solid_or_rings(history, quantity.body)
    values = quantity.factor * history[quantity.variable].sel(half_cycle=half_cycle).values
    return np.asarray(np.tile(values, repeat))


def _solid_or_rings(history: xarray.Dataset, body: str) -> tuple[Array, Any, int]:
    """Return points (m, 3), triangles (t, 3), and how often the nodes' values are repeated around the axis."""
    if model_of(history) == "solid":
        surface = surface_of(history, body)
        return surface.x, surface.triangles, 1
    end = "_strip" if body == "strip" else ""
    r, z, edges = history[f"r{end}"].values, history[f"z{end}"].values, history[f"facets{end}"].values
    turn = 2 * np.pi * np.arange(AROUND + 1)[:, None] / AROUND
    x = np.stack([r * np.cos(turn), r * np.sin(turn), z + 0 * turn], axis=-1).reshape(-1, 3)
    here = len(r) * np.arange(AROUND)[:, None, None] + edges
    there = here + len(r)
    first = np.stack([here[..., 0], here[..., 1], there[..., 1]], axis=-1)
    second = np.stack([here[..., 0], there[..., 1], there[..., 0]], axis=-1)
    return x, np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)]), AROUND + 1


def packed(values: NDArray[Any], kind: str = "<f4") -> dict[str, str]:
    """Return an array (n,) as the page has it, by its kind: "<f4", where NaN is what is not known, or "<i4"."""
    return {kind: base64.b64encode(values.astype(kind).tobytes()).decode()}


_PAGE = """<div id="turned" style="height: {height}px"></div>
<noscript>Scripts are switched off: the figures above show the same without them.</noscript>
<script type="application/json" id="turned-data">{data}</script>
<script type="application/octet-stream" id="turned-script">{script}</script>
<script nonce="{nonce}">
(async () => {{
  const place = document.getElementById("turned");
  try {{
    const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
    const packed = bytes(document.getElementById("turned-script").textContent);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.nonce = "{nonce}";
    script.textContent = await new Response(stream).text();
    document.head.appendChild(script);
    const unpacked = (_, value) => {{
      if (value && value["<f4"]) return Array.from(new Float32Array(bytes(value["<f4"])), (v) => isNaN(v) ? null : v);
      if (value && value["<i4"]) return Array.from(new Int32Array(bytes(value["<i4"])));
      return value;
    }};
    const figure = JSON.parse(document.getElementById("turned-data").textContent, unpacked);
    await Plotly.newPlot(place, figure.data, figure.layout, {{responsive: true, displaylogo: false}});
  }} catch (error) {{
    place.textContent = "This browser cannot draw the map: " + error;
  }}
}})();
</script>"""
