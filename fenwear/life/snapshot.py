"""What a run or a steady state gives, as quantities of interest see it: all contacts, or one that has a name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.cycle import Renewal
from fenwear.errors import CaseError, InputError


def contacts_of(surface: ContactSurface) -> dict[str, Mask]:
    """Return which pressure nodes of a surface are those of each named contact (n,), by their names."""
    return {name: surface.nodes_of(name) for name in surface.names}


@dataclass(frozen=True)
class WornSurface:
    """The worn surface of a body.

    Attributes:
        x: Nodes, ascending (n,), mm.
        weights: Length that each stands for (n,), mm.
        depth: Worn depth (n,), mm; None in a steady state, whose depth grows without end.
        rate: Depth worn in a cycle (n,), mm.
        volume: Worn off as the run has metered it, mm³: of a closed track all that is spread along it, where the
            surface is a part of the track; None in a steady state.
        volume_rate: The same of a cycle, mm³.
        contacts: Which nodes are those of each named contact (n,); empty where none has a name.
    """

    x: Array
    weights: Array
    depth: Array | None
    rate: Array
    volume: float | None
    volume_rate: float
    contacts: Mapping[str, Mask] = field(default_factory=dict)

    def within(self, contact: str) -> WornSurface:
        """Return the surface of one contact; the volume metered is shared as the integrals of the depths are."""
        own = self.contacts[contact]

        def shared(volume: float, depth: Array) -> float:
            whole = float(self.weights @ depth)
            return volume * float(self.weights[own] @ depth[own]) / whole if whole else 0.0

        return WornSurface(
            self.x[own],
            self.weights[own],
            None if self.depth is None else self.depth[own],
            self.rate[own],
            None if self.volume is None or self.depth is None else shared(self.volume, self.depth),
            shared(self.volume_rate, self.rate),
        )

    def later(self, cycles: float) -> WornSurface:
        """Return the surface after cycles more, or less, at the rates of the last one."""
        if self.depth is None or self.volume is None:
            return self
        return replace(self, depth=self.depth + self.rate * cycles, volume=self.volume + self.volume_rate * cycles)


@dataclass(frozen=True)
class Snapshot:
    """The end of a cycle, or the cyclic steady state.

    Attributes:
        cycle: Its number; infinite for the steady state.
        surfaces: Worn surface of each body; of one contact where a body has it.
        x: Contact nodes (n,), mm.
        weights: Length that each stands for (n,), mm.
        pressure: In each phase of the motion (m, n), MPa.
        temperature: Of the contact surfaces at the end of each phase that is known (phases, 2, n), K; None without
            heat.
        friction: Mean friction coefficient of the cycle, weighted by the pressure.
        velocity: Rigid-body wear per cycle of each mode, mm and rad; empty in a run.
        distance: Slid in a cycle, mm.
        period: Duration of a cycle, s.
        contacts: Which nodes are those of each named contact (n,); empty where none has a name.
        renewals: What a run made anew since the last one, each after a half-cycle.
    """

    cycle: float
    surfaces: Mapping[str, WornSurface]
    x: Array
    weights: Array
    pressure: Array
    temperature: Array | None
    friction: float
    velocity: Mapping[str, float]
    distance: float
    period: float
    contacts: Mapping[str, Mask] = field(default_factory=dict)
    renewals: tuple[tuple[int, Renewal], ...] = ()

    def within(self, contact: str, asked: str) -> Snapshot:
        """Return the snapshot of one named contact, or of all for "".

        Raises:
            CaseError: none has this name; names what asked for it.
        """
        if not contact:
            return self
        if contact not in self.contacts:
            known = f"known are {', '.join(self.contacts)}" if self.contacts else "the contacts have no names"
            raise CaseError(InputError(asked, f"no contact is called {contact!r}; {known}"))
        own = self.contacts[contact]
        return replace(
            self,
            surfaces={body: one.within(contact) for body, one in self.surfaces.items() if contact in one.contacts},
            x=self.x[own],
            weights=self.weights[own],
            pressure=self.pressure[:, own],
            temperature=None if self.temperature is None else self.temperature[..., own],
        )

    @property
    def parts(self) -> bool:
        """Whether the surfaces are apart at some nodes in some phase."""
        return bool((self.pressure == 0).any())

    def at_cycle(self, cycle: float) -> Snapshot:
        """Return the snapshot with its depths and volumes carried on to a cycle nearby, at the rate of its last one."""
        moved = {body: own.later(cycle - self.cycle) for body, own in self.surfaces.items()}
        return replace(self, cycle=cycle, surfaces=moved)


def edge_moved(run: Sequence[Snapshot]) -> bool:
    """Return whether an edge of contact or scar has moved within the mesh in a run, be it there and back."""
    if len({len(one.x) for one in run}) > 1:  # a grid has grown with the scar
        return True
    masks = [np.array([(one.pressure > 0).any(axis=0) for one in run])]
    for body in run[-1].surfaces:
        masks.append(np.array([depth > 0 for one in run if (depth := one.surfaces[body].depth) is not None]))
    return any(bool((mask != mask[0]).any()) for mask in masks)
