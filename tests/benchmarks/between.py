"""What each term between the surfaces costs: half-cycles with it over those without, on one core.

python3 tests/benchmarks/between.py [--profile] [--on NODES] [TERM ...]

Planes of 65 and 841 contact nodes and a solid of 289. Times are of the process, the least of rounds in which all take
turns; a ratio of 1.5 at most is what a term may cost: of a law with memory, over a law by expression.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time
from collections.abc import Sequence

import numpy as np

from fenwear import State, Tribosystem, assemble, load_case, register_law
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within

FIRST = 20  # half-cycles that are not timed
BODIES = {  # the case, its settings, half-cycles that are timed, in how many rounds; a hardness that caps some pressure
    "65": ("example1", (), 200, 12, "30 MPa"),
    "841": ("example1", ("geometry.parameters.elements_along_contact=210",), 40, 4, "30 MPa"),
    "289": ("ball-on-flat", (), 40, 4, "900 MPa"),
}
TERMS: dict[str, tuple[str, ...]] = {
    "third body": ("contact.third_body={share=0.6, life='0.3 mm'}",),
    "lost at edges": ("contact.third_body={share=0.6, life='0.3 mm', edge_life='0.1 mm', edge_length='1 mm'}",),
    "lost by a law": ("contact.third_body={share=0.6, life={expression='0.3/(1+debris/1e-4)', unit='mm'}}",),
    "linear": ("contact.layer={kind='linear', stiffness='1e6 MPa/mm'}",),
    "power": ("contact.layer={kind='power', reference='1 um', pressure='100 MPa'}",),
    "exponential": ("contact.layer={kind='exponential', length='1 um', pressure='10 MPa'}",),
    "rough": (
        "contact.layer={kind='rough', roughness='0.2 um', asperity_radius='50 um', asperity_density='1000 1/mm^2'}",
    ),
    "hardness": ("contact.hardness='HARD'",),
    "coating": ("wear.punch.coating={thickness='2 um', coefficient='1e-9 1/MPa'}",),
    "lubrication": ("contact.lubrication={asperity_share={expression='0.2+0.8*exp(-p/30)'}, fluid_friction=0.01}",),
    "friction by p": ("contact.friction={expression='0.1+0.1*exp(-p/30)'}",),
    "law by expression": ("wear.punch.coefficient={expression='2e-8*(1+exp(-p/100))', unit='1/MPa'}",),
    "law with memory": ("wear.punch.coefficient={law='film', unit='1/MPa'}",),
    "creep": ("punch.creep={terms=[{compliance=0.5, time='10 s'}]}",),
}


def film() -> None:
    """Register a film that grows, that sliding rubs off, and that protects."""
    grows = State(lambda now: (1 - now["oxide"]) / 60 - 2e-5 * now["p"] * now["v"] * now["oxide"], of=["p", "v"])
    register_law("film", lambda now: 4e-8 * (1 - 0.9 * now["oxide"]), of=["oxide"], states={"oxide": grows})


def systems(name: str, wanted: Sequence[str]) -> dict[str, Tribosystem]:
    """Return the systems of a body by term, the first without any."""
    case, settings, _, _, hard = BODIES[name]
    found = {"none": assemble(load_case(case, settings))}
    for term in wanted or TERMS:
        found[term] = assemble(load_case(case, (*settings, *(key.replace("HARD", hard) for key in TERMS[term]))))
    return found


def timed(system: Tribosystem, count: int) -> float:
    """Return the time of half-cycles after each other, s; those before them, which factor what is new, do not count."""
    blocks = march_within(system, RunLimits(FIRST + count, stops=frozenset({FIRST})))
    next(blocks)
    begin = time.process_time()
    for _ in blocks:
        pass
    return (time.process_time() - begin) / count


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("terms", nargs="*", metavar="TERM", help="by default all")
    parser.add_argument("--on", choices=BODIES, action="append", help="a body, by its number of nodes; by default all")
    parser.add_argument("--profile", action="store_true", help="tell where the time goes, too")
    given = parser.parse_args()
    film()
    print("| nodes | term | ms a half-cycle | ratio |\n| ---: | --- | ---: | ---: |")
    for name in given.on or BODIES:
        known, (_, _, count, rounds, _) = systems(name, given.terms), BODIES[name]
        times = np.array([[timed(system, count) for system in known.values()] for _ in range(rounds)]).min(axis=0)
        for term, ms, ratio in zip(known, 1e3 * times, times / times[0], strict=True):
            print(f"| {name} | {term} | {ms:.3f} | {ratio:.2f} |", flush=True)
        if given.profile:
            for term, system in known.items():
                profile = cProfile.Profile()
                profile.runcall(timed, system, count)
                print(term)
                pstats.Stats(profile).sort_stats("tottime").print_stats(22)


if __name__ == "__main__":
    main()
