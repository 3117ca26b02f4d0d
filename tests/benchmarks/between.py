"""What each term between the surfaces costs: half-cycles with it over those without, on one core.

python3 tests/benchmarks/between.py [--profile] [TERM ...]

Planes of 65 and 1,001 contact nodes and a solid of 289. Times are of the process, the least of rounds in which all take
turns; a ratio of 1.5 at most is what a term may cost: of a law with memory, over a law by expression.
"""

from __future__ import annotations

import cProfile
import pstats
import sys
import time
from functools import partial

import numpy as np

from fenwear import State, Tribosystem, assemble, load_case, march, register_law

ROUNDS = 5
BODIES = {
    "plane, 65 nodes": ("example1", (), 300, "30 MPa"),
    "plane, 1001 nodes": ("example1", ("geometry.parameters.elements_along_contact=500",), 20, "30 MPa"),
    "solid, 289 nodes": ("ball-on-flat", (), 40, "900 MPa"),
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
    "law by expression": ("wear.punch.coefficient={expression='2e-8*(1+exp(-p/100))', unit='1/MPa'}",),
    "law with memory": ("wear.punch.coefficient={law='film', unit='1/MPa'}",),
    "creep": ("punch.creep={terms=[{compliance=0.5, time='10 s'}]}",),
}


def film() -> None:
    """Register a film that grows, that sliding rubs off, and that protects."""
    grows = State(lambda now: (1 - now["film"]) / 60 - 2e-5 * now["p"] * now["v"] * now["film"], of=["p", "v"])
    register_law("film", lambda now: 4e-8 * (1 - 0.9 * now["film"]), of=["film"], states={"film": grows})


def systems(name: str) -> tuple[dict[str, Tribosystem], int]:
    """Return the systems of a body by term, the first without any, and how many half-cycles are timed."""
    case, settings, count, hard = BODIES[name]
    wanted = [one for one in sys.argv[1:] if not one.startswith("--")]
    found = {"none": assemble(load_case(case, settings))}
    for term, keys in TERMS.items():
        if not wanted or term in wanted:
            found[term] = assemble(load_case(case, (*settings, *(key.replace("HARD", hard) for key in keys))))
    return found, count


def run(system: Tribosystem, count: int) -> None:
    """March through half-cycles."""
    for _ in march(system, count):
        pass


def timed(system: Tribosystem, count: int) -> float:
    """Return the time of half-cycles after each other, s."""
    begin = time.process_time()
    run(system, count)
    return (time.process_time() - begin) / count


def main() -> None:
    """Print the table."""
    film()
    print("| body | term | ms a half-cycle | ratio |\n| --- | --- | ---: | ---: |")
    for name in BODIES:
        given, count = systems(name)
        for system in given.values():
            run(system, 4)
        times = np.array([[timed(system, count) for system in given.values()] for _ in range(ROUNDS)])
        ratios = times.min(axis=0) / times[:, 0].min()
        for term, ms, ratio in zip(given, 1e3 * times.min(axis=0), ratios, strict=True):
            print(f"| {name} | {term} | {ms:.3f} | {ratio:.2f} |", flush=True)
        if "--profile" in sys.argv[1:]:
            for term, system in given.items():
                profile = cProfile.Profile()
                profile.runcall(partial(run, system, count))
                print(term)
                pstats.Stats(profile).sort_stats("tottime").print_stats(22)


if __name__ == "__main__":
    main()
