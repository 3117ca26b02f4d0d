"""What a model predicts for the conditions and places of measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fenwear.arrays import Array
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.errors import CaseError, InputError
from fenwear.life.data import DataSet, Series
from fenwear.life.model import FREE, Course, Model, Snapshot
from fenwear.life.quantities import Quantity, cycles_of, padded, registered_name, unit_of
from fenwear.results.surfaces import at_places, rim


class Predictor:
    """What a model predicts for data sets: one run for each condition, on jumps that can be kept."""

    def __init__(self, model: Model, data: Sequence[DataSet]) -> None:
        self.model, self.data = model, list(data)
        self._courses: dict[tuple[str, ...], Course] = {}

    def keep_jumps(self, values: Mapping[str, float]) -> bool:
        """Let the runs from now on jump as those at these values do; return whether that is otherwise than before."""
        before, self._courses = self._courses, {}
        self._courses = {settings: Course.of(snapshots) for settings, snapshots in self._runs(values).items()}
        return self._courses != before

    def __call__(self, values: Mapping[str, float], *, strict: bool = False) -> list[Array]:
        """Return the predictions of every series, in the order of the data sets.

        Args:
            values: Of the keys.
            strict: Whether a scar that outgrows the contact surface is an error; in a trial of a fit it is none.

        Raises:
            CaseError: a scar has outgrown the contact surface.
        """
        runs = self._runs(values)
        found = []
        for one in self.data:
            measures = self.model.cycle_measures(values, one.settings)
            found += [_predict(series, runs[one.settings], measures, strict=strict) for series in one.series]
        return found

    def _runs(self, values: Mapping[str, float]) -> dict[tuple[str, ...], list[Snapshot]]:
        wanted: dict[tuple[str, ...], set[int]] = {}
        for one in self.data:
            measures = self.model.cycle_measures(values, one.settings)
            stops = wanted.setdefault(one.settings, set())
            for series in one.series:
                stops |= {max(1, round(cycles_of((a, series.counted), *measures))) for a in np.unique(series.after)}
        runs = {}
        for settings, stops in wanted.items():
            course = self._courses.get(settings, FREE)
            last = course.last(max(stops))
            runs[settings] = list(self.model.run(values, last, settings=settings, stops=sorted(stops), course=course))
        return runs


def _predict(series: Series, snapshots: Sequence[Snapshot], measures: tuple[float, float], *, strict: bool) -> Array:
    ends = np.array([s.cycle for s in snapshots])
    predicted = np.empty(len(series.values))
    name = registered_name(series.quantity, at_a_place=series.is_profile)
    quantity = Quantity(name, name, "snapshot", unit_of(name), series.body)
    for amount in np.unique(series.after):
        cycles = cycles_of((float(amount), series.counted), *measures)
        snapshot = snapshots[int(np.argmin(np.abs(ends - cycles)))].at_cycle(cycles)
        own = series.after == amount
        if series.is_profile:
            predicted[own] = _profile(series, snapshot, series.places[own], strict=strict)
        else:
            predicted[own] = quantity.of_snapshot(snapshot)
    return predicted


def _profile(series: Series, snapshot: Snapshot, x: Array, *, strict: bool) -> Array:
    """Return the depth at places along x, in a solid at y = 0 (k,); nothing is worn beyond the contact surface.

    Raises:
        CaseError: the scar reaches the end of the modelled contact surface, and the profile beyond it.
    """
    surface: ContactSurface = getattr(snapshot.end.system.pair, series.body)
    depth: Array = getattr(snapshot.end, "wear_strip" if series.body == "strip" else "wear")[-1]
    places = padded(x[:, None], surface.dim - 1)
    found = at_places(surface, depth, places)
    beyond = np.isnan(found)
    if strict and beyond.any():
        nodes = surface.abscissa[:, None] if surface.dim == 2 else surface.x[:, :2]
        ends = np.flatnonzero(rim(surface))
        nearest = [ends[np.linalg.norm(nodes[ends] - place, axis=1).argmin()] for place in places[beyond]]
        if (depth[nearest] > 1e-3 * depth.max()).any():
            low, high = surface.abscissa.min(), surface.abscissa.max()
            raise CaseError(
                InputError(
                    "geometry",
                    f"the scar reaches the end of the contact surface, which spans {low:g} to {high:g} mm. The "
                    f"measured profile spans x = {x.min():g} to {x.max():g} mm. Expected a wider contact surface",
                )
            )
    return np.where(beyond, 0.0, found)
