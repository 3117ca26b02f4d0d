"""What goes with what: laws of contact, what a case may have, and all that can be asked of it; read by the docs, too.

A cell is closed where physics, or the model, has nothing to say there; its reason is in `CLOSED`. All others are open
and walked by `test_combinations.py`, but for those whose parts other cells walk.
"""

from __future__ import annotations

LAWS = {"gross sliding": "gross-sliding", "stick (Coulomb)": "coulomb"}

SMALL = (
    "geometry.parameters.elements_along_contact=8",
    "geometry.parameters.overlap=0.05",
    "geometry.follow_wear='never'",
    "wear={punch={coefficient='1e-7 1/MPa'}}",
    "run.integration='explicit'",
    "run.half_cycles=4",
    "output.report=false",
    "output.uncertainty=false",
    "output.fields_at=[]",
)
STICK = ("stick.steps=4", "stick.step_tolerance=1")
STEEL = (
    "poisson=0.3, conductivity='45 W/(m K)', heat_capacity='460 J/(kg K)', density='7800 kg/m^3', "
    "expansion='1.2e-5 1/K'"
)
WARM = (
    f"materials.steel={{young='200 GPa', {STEEL}}}",
    "heat={convection='20 W/(m^2 K)', steps=2}",
    "strip.temperatures=[{on='strip_bottom', temperature='0 K'}]",
    "motion.period='0.001 s'",
)
ONE_WAY = "motion={kind='one-way', direction='rightward', speed='10 mm/s', duration='0.1 s'}"

# What a case may have besides: base, settings.
FEATURES: dict[str, tuple[str, tuple[str, ...]]] = {
    "in the plane": ("fretting-partial-slip", SMALL),
    "heat, to and fro": ("fretting-partial-slip", (*SMALL, *WARM)),
    "heat, one way": ("fretting-partial-slip", (*SMALL, *WARM[:3], ONE_WAY)),
    "heat on a closed track": (
        "fretting-partial-slip",
        (
            *SMALL,
            WARM[0],
            "heat={convection='20 W/(m^2 K)', steps=2, track={heat_capacity='0.01 J/K', loss='0.001 W/K'}}",
            WARM[2],
            ONE_WAY,
        ),
    ),
    "properties of T": (
        "fretting-partial-slip",
        (
            *SMALL,
            *WARM[1:],
            f"materials.steel={{young={{table=[[0, 2e5], [1e-3, 1.5e5]], of='T'}}, {STEEL}}}",
            "heat.property_tolerance=0.001",
        ),
    ),
    "friction by p and v": (
        "fretting-partial-slip",
        (*SMALL, "contact.friction={expression='0.7 + 1e-5 * p + 0.1 * exp(-v)'}"),
    ),
    "wear by p, T and place": (
        "fretting-partial-slip",
        (
            *SMALL,
            *WARM,
            "wear={punch={coefficient={expression='1e-7 * (1 + p / 500 + T / 10 + x ** 2)', unit='1/MPa'}}}",
        ),
    ),
    "wear by depth and distance": (
        "fretting-partial-slip",
        (*SMALL, "wear={punch={coefficient={expression='1e-7 * (1 + depth / 1e-5 + s / 1)', unit='1/MPa'}}}"),
    ),
    "wear above a threshold": (
        "fretting-partial-slip",
        (*SMALL, "wear={punch={coefficient='1e-7 1/MPa', pressure_threshold='50 MPa'}}"),
    ),
    "meshes that follow": ("fretting-partial-slip", (*SMALL, "geometry.follow_wear=1e-6")),
    "both bodies worn": (
        "fretting-partial-slip",
        (*SMALL, "wear.strip.coefficient='1e-7 1/MPa'", "motion.positions=3"),
    ),
    "what lies between": (
        "fretting-partial-slip",
        (
            *SMALL,
            "contact.third_body={share=0.6, life='0.3 mm'}",
            "contact.layer={kind='exponential', length='1 um', pressure='10 MPa'}",
        ),
    ),
    "debris on the strip": (
        "fretting-partial-slip",
        (
            *SMALL,
            "wear={punch={coefficient='1e-7 1/MPa'}, strip={coefficient='1e-7 1/MPa'}}",
            "motion.positions=3",
            "contact.third_body={share=0.6, life='0.3 mm', carried_by='strip'}",
        ),
    ),
    "debris by laws": (
        "fretting-partial-slip",
        (
            *SMALL,
            "contact.third_body={share=0.8, life={expression='3 / (1 + 1e3 * debris)', unit='mm'}, edge_life='0.3 mm', "
            "edge_length='0.02 mm'}",
            "wear={punch={coefficient={expression='1e-7 * (0.2 + 0.8 * exp(-debris / 1e-3))', unit='1/MPa'}}}",
        ),
    ),
    "all that lies between": (
        "fretting-partial-slip",
        (
            *SMALL,
            "contact.third_body={share=0.6, life='0.3 mm', edge_life='0.3 mm', edge_length='0.02 mm'}",
            "contact.lubrication={asperity_share={expression='0.9 + 0.1 * exp(-p / 500)'}, fluid_friction=0.6}",
            "contact.layer={kind='exponential', length='1 um', pressure='10 MPa'}",
            "contact.hardness='550 MPa'",
            "punch.creep={terms=[{compliance=0.2, time='2e-3 s'}]}",
            "wear={punch={coefficient='2e-7 1/MPa', coating={thickness='0.1 um', coefficient='1e-7 1/MPa', "
            "modulus='500 MPa'}}}",
            "contact.friction={law='slippery'}",
        ),
    ),
    "a coating": (
        "fretting-partial-slip",
        (
            *SMALL,
            "wear={punch={coefficient={expression='2e-7 * (1 + p / 1000)', unit='1/MPa'}, "
            "coating={thickness='1e-7 mm', coefficient='1e-7 1/MPa', friction=0.69, modulus='500 MPa'}}}",
        ),
    ),
    "laws with memory": (  # registered in `test_combinations.py`
        "fretting-partial-slip",
        (
            *SMALL,
            "wear={punch={coefficient={law='filmed'}}}",
            "contact.friction={law='slippery'}",
        ),
    ),
    "a cycle as a table": (
        "fretting-partial-slip",
        (
            *SMALL,
            "punch.loads=[]",
            "motion={kind='cycle', columns=['time (s)', 'shift_x (um)', 'force_z (N)'], load={on='punch_top'}, "
            "rows=[[0, -3, -120], [2e-4, 3, -118], [1e-3, -3, -120]]}",
            "contact.friction={expression='0.7 + 1e-4 * pm + cs'}",
        ),
    ),
    "in rings": (
        "ring-on-ring",
        ("geometry.parameters.across=4", "geometry.degree=2", "run.half_cycles=4", "run.integration='explicit'",
         "geometry.follow_wear='never'", "output.report=false", "output.uncertainty=false",
         "output.fields_at=[]", "motion={kind='oscillation', axis=[0, 0, 1], amplitude='4e-6 rad', period='1 s'}",
         "geometry.parameters.margin_inside=0", "geometry.parameters.margin_outside=0",
         "materials.bronze={young='210 GPa', poisson=0.3}", "punch.supports=[{on='punch_far', fix=['x']}]",
         "contact.friction=0.3", "wear={punch={coefficient='1e-5 1/MPa'}, strip={coefficient='1e-6 1/MPa'}}"),
    ),
    "in solids": (
        "fretting-sphere",
        ("geometry.parameters.across=4", "geometry.follow_wear='never'", "run.half_cycles=4", "output.report=false",
         "output.uncertainty=false", "output.fields_at=[]", "run.integration='explicit'",
         "wear={punch={coefficient='1e-7 1/MPa'}}"),
    ),
}  # fmt: skip

WAYS = ("march", "jump", "steady", "program", "resume", "ranks", "sweep", "sensitivity", "calibrate", "life")

SLIDES = "what slides one way slips at every node after the first of it: gross sliding is the answer"
PASSES = "changes throughout a run: a cyclic steady state does not exist"
DEEPENS = "to and fro the track of a strip that wears deepens for ever, most where every position touches"
KEEPS = "slipping nodes keep any pressure below the threshold, as the way there has left it: no end is known without it"
FLOWS = "what flows beyond the hardness depends on the way there: no end is known without it"

# Closed cells, by feature, law and way; None for all of them.
CLOSED: dict[tuple[str, str | None, str | None], str] = {
    ("heat, one way", "stick (Coulomb)", None): SLIDES,
    ("heat on a closed track", "stick (Coulomb)", None): SLIDES,
    ("wear by depth and distance", "gross sliding", "steady"): PASSES,
    ("both bodies worn", "gross sliding", "steady"): DEEPENS,
    ("debris on the strip", "gross sliding", "steady"): DEEPENS,
    ("wear above a threshold", "stick (Coulomb)", "steady"): KEEPS,
    ("all that lies between", "stick (Coulomb)", "steady"): FLOWS,
}


def closed(feature: str, law: str, way: str) -> str:
    """Return why a cell is closed; "" where it is open."""
    for key in ((feature, law, way), (feature, law, None), (feature, None, way), (feature, None, None)):
        if key in CLOSED:
            return CLOSED[key]
    return ""
