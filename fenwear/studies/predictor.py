"""Predictions of a model for the conditions and places of measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.results.history_surfaces import at_places, rim
from fenwear.studies.measured_data import DataSet, Series
from fenwear.studies.model import FREE, Course, Model, Snapshot
from fenwear.studies.quantities import Quantity, cycles_of, padded, registered_name, unit_of
from fenwear.studies.study import Values


class Predictor:
    """Predicts measurements by a model: one run for each condition, on jumps that can be kept.

    Attributes:
        model: The model.
        data: Measured values.
        conditions: For each condition, named by its overrides, the series that were measured under it.
    """

    def __init__(self, model: Model, data: Sequence[DataSet]) -> None:
        self.model, self.data = model, list(data)
        self.conditions: dict[tuple[str, ...], list[Series]] = {}
        for data_set in self.data:
            self.conditions.setdefault(data_set.settings, []).extend(data_set.series)
        self._courses: dict[tuple[str, ...], Course] = {}

    def keep_jumps(self, values: Mapping[str, float]) -> bool:
        """Let the runs from now on jump as those at these values do; return whether that is otherwise than before."""
        before, self._courses = self._courses, {}
        self._courses = {settings: Course.of(self._run(values, settings)) for settings in self.conditions}
        return self._courses != before

    def __call__(self, values: Mapping[str, float], *, strict: bool = False) -> list[Array]:
        """Return the predictions of every series, in the order of the data sets.

        Args:
            values: Of the keys.
            strict: Whether a scar that outgrows the contact surface is an error; in a trial of a fit it is none.

        Raises:
            CaseError: a scar has outgrown the contact surface.
        """
        predictions = {settings: iter(self._predicted(values, settings, strict=strict)) for settings in self.conditions}
        return [next(predictions[data_set.settings]) for data_set in self.data for _ in data_set.series]

    def compute(self, given: tuple[Mapping[str, float], tuple[str, ...]]) -> Values:
        """Return the predictions of all series under one condition (k,), for values of the keys and its overrides."""
        return {"prediction": np.concatenate(self._predicted(*given, strict=False))}

    def _predicted(self, values: Mapping[str, float], settings: tuple[str, ...], *, strict: bool) -> list[Array]:
        measures, snapshots = self.model.cycle_measures(values, settings), self._run(values, settings)
        return [_predict(series, snapshots, measures, strict=strict) for series in self.conditions[settings]]

    def _run(self, values: Mapping[str, float], settings: tuple[str, ...]) -> list[Snapshot]:
        measures = self.model.cycle_measures(values, settings)
        amounts = {
            (float(after), series.counted) for series in self.conditions[settings] for after in np.unique(series.after)
        }
        stops = sorted({max(1, round(cycles_of(amount, *measures))) for amount in amounts})
        course = self._courses.get(settings, FREE)
        return list(self.model.run(values, course.last(stops[-1]), settings=settings, stops=stops, course=course))


def _predict(series: Series, snapshots: Sequence[Snapshot], measures: tuple[float, float], *, strict: bool) -> Array:
    ends = np.array([s.cycle for s in snapshots])
    predicted = np.empty(len(series.values))
    name = registered_name(series.quantity, at_a_place=series.is_profile)
    quantity = Quantity(name, name, "snapshot", unit_of(name), series.body)
    for amount in np.unique(series.after):
        cycles = cycles_of((float(amount), series.counted), *measures)
        snapshot = snapshots[int(np.argmin(np.abs(ends - cycles)))].at_cycle(cycles)
        rows = series.after == amount
        if series.is_profile:
            predicted[rows] = _profile(series, snapshot, series.places[rows], strict=strict)
        else:
            predicted[rows] = quantity.of_snapshot(snapshot)
    return predicted


def _profile(series: Series, snapshot: Snapshot, x: Array, *, strict: bool) -> Array:
    """Return the depth at places along x, in a solid at y = 0 (k,); nothing is worn beyond the contact surface.

    Raises:
        CaseError: the scar reaches the end of the modelled contact surface, and the profile beyond it.
    """
    surface: ContactSurface = getattr(snapshot.end.system.pair, series.body)
    depth: Array = getattr(snapshot.end, "wear_strip" if series.body == "strip" else "wear")[-1]
    places = padded(x[:, None], surface.dim - 1)
    depths = at_places(surface, depth, places)
    beyond = np.isnan(depths)
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
    return np.where(beyond, 0.0, depths)
