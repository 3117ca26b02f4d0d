"""Results of a case for values of its keys: runs by cycle jumps and steady states, on one process.

The one module of this package that knows how a system is assembled and integrated. Each rank has its
own systems, so that samples can be shared out among ranks and no result depends on their number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any, TypeVar, cast

import numpy as np
from mpi4py import MPI

from fenwear.case import Case
from fenwear.checks import Seen
from fenwear.checks.law_choice import check_decided
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.laws.wear import WornDepths
from fenwear.results.summary import within
from fenwear.steps import Block, Renewal, critical_speed, follow, running_in, steady
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.steps.run_state import RunState, Totals, all_phases, beginning, cycle_totals
from fenwear.steps.steady_cycle import SteadyCycle, cycle_of_state
from fenwear.steps.stick_final import FinalShape, cycle_of_final
from fenwear.studies.numeric_keys import with_values
from fenwear.system import Tribosystem, assemble, with_case

T = TypeVar("T")
RECENT = 8  # systems kept, as a run and its measures ask for the same one
KEPT = 32  # runs whose ends are kept
ONE_STEP = 10**12  # cycles: a jump reaches as far as the next stop
WITHIN = 1e-9  # relative: what properties of the temperature may still change by in a steady state, for differences
FINE_JUMPS = 0.03  # of the fraction: tolerance of jumps on the way to the end, whose derivatives are then good to 3 %
NEAR_THE_END = 0.01  # of the pressure scale: where the run-in is over


@dataclass(frozen=True)
class Course:
    """The steps of an earlier run that a run repeats, so that its results are smooth functions of the keys.

    Attributes:
        ends: Cycles at whose ends jumps end, and nowhere else; none of a run that finds its own.
        renewals: The half-cycles after which meshes, properties or grids were renewed.
    """

    ends: tuple[int, ...] = ()
    renewals: Mapping[int, Renewal] = field(default_factory=dict)

    @property
    def given(self) -> bool:
        """Whether there is a run to follow."""
        return bool(self.ends)

    def last(self, otherwise: int) -> int:
        """Return the cycle that a run ends with: that of the run it follows, or another one."""
        return self.ends[-1] if self.given else otherwise

    @classmethod
    def of(cls, snapshots: Sequence[Snapshot]) -> Course:
        """Return the course of a run of these snapshots."""
        made = {half_cycle: renewal for snapshot in snapshots for half_cycle, renewal in snapshot.renewals}
        return cls(tuple(int(snapshot.cycle) for snapshot in snapshots), made)


FREE = Course()  # of a run that finds its own


@dataclass(frozen=True)
class RunSamples:
    """A run: its last snapshot, its course, and whether an edge of contact or scar moved in it within the mesh."""

    last: Snapshot
    course: Course
    moved: bool


@dataclass
class Model:
    """A case, ready to be asked for other values of its keys.

    Runs are made by cycle jumps with the case's run.jump_tolerance, whatever run.integration says.

    Attributes:
        case: The case.
        evaluations: Runs and steady states computed so far.
    """

    case: Case
    evaluations: int = 0
    _bases: dict[tuple[str, ...], Tribosystem] = field(default_factory=dict, repr=False)
    _recent: dict[tuple[object, ...], Tribosystem] = field(default_factory=dict, repr=False)
    _runs: dict[tuple[object, ...], RunSamples] = field(default_factory=dict, repr=False)
    _states: dict[tuple[object, ...], Snapshot] = field(default_factory=dict, repr=False)

    def __reduce__(self) -> tuple[type[Model], tuple[Case]]:
        return type(self), (self.case,)  # another process assembles systems of its own

    def __post_init__(self) -> None:
        """Refuse a test program.

        Raises:
            CaseError: the case has one.
        """
        if self.case.program is not None:
            message = "studies of lives take constant loads and motion. Remove the program, or use `run` with run.until"
            raise CaseError(InputError("program", message))

    @property
    def warming(self) -> bool:
        """Whether properties of materials depend on the temperature."""
        return any(material.dependent for material in self.case.materials.values())

    def stick_left_out(self) -> list[str]:
        """Return the warning of stick that the case leaves out, with an estimate."""
        return Seen.of_system(self.system()).warnings("system")

    def _check_stays(self) -> None:
        """Reject laws that change throughout a run where a steady state is asked for.

        Raises:
            CaseError: there is one.
        """
        for key in self.case.passing_laws:
            message = (
                "depends on the worn depth or the distance slid. It changes throughout a run, so that no steady state "
                "exists. Ask for a quantity of a run, such as 'wear after 100 cycles'"
            )
            raise CaseError(InputError(key, message))

    def _check_constant(self, quantity: str) -> None:
        """Reject properties that depend on the temperature for quantities of the bodies at the start.

        Raises:
            CaseError: there are some.
        """
        for name, material in self.case.materials.items():
            for key in material.dependent:
                message = f"depends on the temperature, but the {quantity} requires constant properties; expected one"
                raise CaseError(InputError(f"materials.{name}.{key}", message))

    def system(self, values: Mapping[str, float] | None = None, settings: Sequence[str] = ()) -> Tribosystem:
        """Return the assembled problem with keys at these values; what does not change is shared.

        Raises:
            CaseError: a value is not possible, or the case calls for stick.
        """
        base = self._base(tuple(settings))
        if not values:
            return base
        key = (tuple(settings), tuple(sorted(values.items())))
        return _kept(self._recent, key, RECENT, lambda: with_case(base, with_values(base.case, values)))

    def _base(self, settings: tuple[str, ...]) -> Tribosystem:
        if settings not in self._bases:
            first = next(iter(self._bases.values()), None)
            case = with_values(self.case, {}, settings)
            base = assemble(case, MPI.COMM_SELF, heat="reduced") if first is None else with_case(first, case)
            check_decided(base)
            self._bases[settings] = base
        return self._bases[settings]

    def cycle_measures(
        self, values: Mapping[str, float] | None = None, settings: Sequence[str] = ()
    ) -> tuple[float, float]:
        """Return the distance slid in a cycle, mm, mean over the contact surface, and its duration, s."""
        system = self.system(values, settings)
        states = [system.phases.conditions(k) for k in range(len(system.sliding.pairs))]
        unpressed = np.zeros((len(system.sliding.pairs), len(system.pair.weights)))
        return float(cycle_totals(system, unpressed, states).of("distance")), system.motion.period

    def run(
        self,
        values: Mapping[str, float],
        cycles: int,
        *,
        settings: Sequence[str] = (),
        stops: Sequence[int] = (),
        course: Course = FREE,
        until: Callable[[Snapshot], bool] = lambda _: False,
    ) -> Iterator[Snapshot]:
        """Yield the end of every jump, from the first to the last.

        Args:
            values: Of keys, in their internal units.
            cycles: Largest number.
            settings: Overrides `key.path=value` besides.
            stops: Cycles at whose end a jump ends in any case.
            course: Of another run, which this one is to follow, or `FREE`.
            until: Ends the run at the first snapshot for which it is true.

        Raises:
            CaseError: a value is not possible.
            ConvergenceError: a jump did not converge.
        """
        system = self.system(values, settings)
        self.evaluations += 1
        strokes, case = system.motion.half_cycles, system.case
        tolerance = np.inf if course.given else case.run.jump_tolerance
        ends = frozenset(strokes * end for end in course.ends or stops)
        renewals: list[tuple[int, Renewal]] = []

        def integrate(on: Tribosystem, limits: RunLimits, start: RunState | None) -> Iterator[Block]:
            if course.given:
                start = replace(start or beginning(on), jump_length=ONE_STEP)
            return jump_within(on, limits, start, tolerance=tolerance)

        # The elements' heights are the base's wherever the geometry is: no need to measure them anew.
        base = self._base(tuple(settings))
        blocks = follow(
            system,
            integrate,
            RunLimits(strokes * cycles, block=strokes, stops=ends),
            given=course.renewals if course.given else None,
            heights_of=base if base.case.geometry == case.geometry else system,
            on_renewal=lambda half_cycle, renewal: renewals.append((half_cycle, renewal)),
        )
        for block in blocks:
            snapshot = replace(snapshot_of(block), renewals=tuple(renewals))
            renewals.clear()
            yield snapshot
            if until(snapshot):
                return

    def samples(
        self,
        values: Mapping[str, float],
        cycles: int,
        settings: Sequence[str] = (),
        course: Course = FREE,
    ) -> RunSamples:
        """Return a run to its end, as `run`; kept, so that several quantities of it cost one."""
        followed = course.ends, tuple(course.renewals.items())
        key = (tuple(sorted(values.items())), cycles, tuple(settings), followed)

        def run() -> RunSamples:
            taken = list(self.run(values, cycles, settings=settings, course=course))
            return RunSamples(taken[-1], Course.of(taken), edge_moved(taken))

        return _kept(self._runs, key, KEPT, run)

    def steady(self, values: Mapping[str, float], settings: Sequence[str] = ()) -> Snapshot:
        """Return the cyclic steady state, with properties of its own temperatures where they depend on them; kept.

        Raises:
            CaseError: a value is not possible.
            ConvergenceError: there is none, or it was not found.
        """
        key = (tuple(sorted(values.items())), tuple(settings))
        return _kept(self._states, key, KEPT, lambda: self._steady(values, settings))

    def _steady(self, values: Mapping[str, float], settings: Sequence[str]) -> Snapshot:
        self._check_stays()
        system = self.system(values, settings)
        self.evaluations += 1
        if system.law.sticks:
            end = cycle_of_final(cast(FinalShape, steady(system)))  # under Coulomb's law
        else:
            end = cycle_of_state(steady(system, properties_within=WITHIN if self.warming else None))
        return Snapshot(np.inf, end, end.rate, end.phase_pressure)

    def run_in(
        self, values: Mapping[str, float], settings: Sequence[str] = (), course: Course = FREE
    ) -> tuple[float, Course]:
        """Return after how many cycles the pressure is within 1 % of the pressure scale of its end; infinite if never.

        And the course of its jumps, which values nearby are to follow.

        Raises:
            ConvergenceError: there is no steady state.
        """
        self._check_constant("run-in")
        self._check_stays()
        system = self._sliding("run_in", values, settings)
        self.evaluations += 1
        state = steady(system)
        running = running_in(state.system, state, NEAR_THE_END, jumps=FINE_JUMPS, ends=course.ends)
        return (np.inf, FREE) if running is None else (running.cycles, Course(running.ends))

    def critical_speed(self, values: Mapping[str, float], settings: Sequence[str] = ()) -> float:
        """Return the speed above which full contact is thermo-elastically unstable in either direction, mm/s.

        Raises:
            CaseError: the case has no heat.
        """
        self._check_constant("critical speed")
        system = self._sliding("critical_speed", values, settings)
        self.evaluations += 1
        return min(critical_speed(system, d) for d in sorted(set(system.motion.directions)))

    def _sliding(self, quantity: str, values: Mapping[str, float], settings: Sequence[str]) -> Tribosystem:
        """Return the system for a quantity of surfaces that slide as a whole.

        Raises:
            CaseError: nodes stick or slip by themselves.
        """
        system = self.system(values, settings)
        if system.law.sticks:
            message = (
                "has no value in partial slip: wear continues until slipping nodes carry nothing. Use gross sliding"
            )
            raise CaseError(InputError(quantity, message))
        return system


def _kept(cache: dict[tuple[object, ...], T], key: tuple[object, ...], most: int, compute: Callable[[], T]) -> T:
    """Return a value of a cache, which keeps so many; computed where it is not there."""
    if key not in cache:
        while len(cache) >= most:
            cache.pop(next(iter(cache)))
        cache[key] = compute()
    return cache[key]


@dataclass(frozen=True)
class Snapshot:
    """The end of a cycle, or the cyclic steady state, of which quantities are computed as of a run.

    Attributes:
        cycle: Its number; infinite for the steady state.
        end: The half-cycles of the cycle.
        rate: Depths worn in a cycle.
        phase_pressure: In each phase or time step of the cycle (m, n), MPa.
        renewals: The renewals of a run since the last snapshot, each after a half-cycle.
    """

    cycle: float
    end: Block | SteadyCycle
    rate: WornDepths
    phase_pressure: Array
    renewals: tuple[tuple[int, Renewal], ...] = ()

    @property
    def velocity(self) -> Mapping[str, float]:
        """Rigid-body wear per cycle of each mode, mm and rad; empty in a run."""
        return self.end.velocity if isinstance(self.end, SteadyCycle) else {}

    @property
    def parts(self) -> bool:
        """Whether the surfaces are apart at some nodes in some phase."""
        return bool((self.phase_pressure == 0).any())

    def within(self, contact: str, asked: str) -> Snapshot:
        """Return the snapshot of one named contact, or of all for "".

        Raises:
            CaseError: none has this name; names what asked for it.
        """
        if not contact:
            return self
        pair = self.end.system.pair
        if contact not in pair.punch.names:
            names = ", ".join(pair.punch.names)
            known = f"known are {names}" if names else "the contacts have no names"
            raise CaseError(InputError(asked, f"no contact is called {contact!r}; {known}"))
        masks = [
            surface.nodes_of(contact) if contact in surface.names else np.zeros(len(surface.weights), dtype=bool)
            for surface in (pair.punch, pair.strip)
        ]
        depths = zip(masks, (self.rate.punch, self.rate.strip), strict=True)
        rate = WornDepths(*(np.where(nodes, depth, 0.0) for nodes, depth in depths))
        return replace(self, end=within(self.end, contact, self.rate), rate=rate)

    def at_cycle(self, cycle: float) -> Snapshot:
        """Return the snapshot with its depths and volumes carried on to a cycle nearby, at the rate of its last one."""
        if not isinstance(self.end, Block) or cycle == self.cycle:
            return replace(self, cycle=cycle)
        end, ahead = self.end, cycle - self.cycle
        totals = end.totals + cycle_of(end).times(ahead)
        wear, wear_strip = end.wear + ahead * self.rate.punch, end.wear_strip + ahead * self.rate.strip
        return replace(self, cycle=cycle, end=replace(end, wear=wear, wear_strip=wear_strip, totals=totals))


def edge_moved(run: Sequence[Snapshot]) -> bool:
    """Return whether an edge of contact or scar has moved within the mesh in a run, be it there and back."""
    ends = [snapshot.end for snapshot in run if isinstance(snapshot.end, Block)]
    if len({end.pressure.shape[1] for end in ends}) > 1:  # a grid has grown with the scar
        return True
    masks = [np.array([(snapshot.phase_pressure > 0).any(axis=0) for snapshot in run])]
    masks += [np.array([getattr(end, body)[-1] > 0 for end in ends]) for body in ("wear", "wear_strip") if ends]
    return any(bool((mask != mask[0]).any()) for mask in masks)


def cycle_of(end: Block | SteadyCycle) -> Totals:
    """Return the totals of the last cycle."""
    adds, strokes = end.adds, end.system.motion.half_cycles
    return Totals(*(rows[-strokes:].sum(axis=0) for rows in (adds.sums, adds.energy, adds.pressure)))


def snapshot_of(block: Block) -> Snapshot:
    """Return the end of the last cycle of a block."""
    system, pressure, end = block.system, all_phases(block.end.contacts).pressure, block.end
    strokes = system.motion.half_cycles
    if block.steps:
        steps: tuple[Any, ...] = block.steps[-strokes:]
        rate = reduce(WornDepths.__add__, [stroke.wear for stroke in steps])
        pressure = np.concatenate([stroke.records.pressure for stroke in steps])
    else:
        pressure, heat = pressure if len(pressure) else block.pressure, block.heat
        latest = None if heat is None else (heat.temperature_punch[-1], heat.temperature_strip[-1])
        states = [
            system.phases.conditions(k, np.asarray(p), latest, end.worn, end.half_cycle) for k, p in enumerate(pressure)
        ]
        rate = system.phases.wear.phases(states).worn(pressure)
    return Snapshot(float(block.half_cycle[-1] // strokes), block, rate, pressure)
