"""The whole way from a case to bodies that are ready to slide, step by step.

    bodies  = build_bodies(case)                   meshes, stiffness, supports, loads, conduction
    sliding = make_sliding(case)                   motion, sliding field, friction, wear laws
    placed  = place(bodies, sliding, case.heat,    surfaces opposite each other in every phase, in equilibrium
                    case=case)                     (the case gives the loads of each phase)
    system  = elastic(placed)                      both bodies condensed and joined in every phase
    system  = with_exchange(system)                heat: the steps of the motion, prepared

`assemble` takes all of them. Each step returns plain data and is collective: every rank takes it. `vary`
takes again what a changed case makes necessary, and keeps the rest.
"""

from fenwear.system.both_bodies import Bodies, build_bodies, build_conduction, elastic_body
from fenwear.system.contact_laws import ContactLaw, law_named, register_contact_law
from fenwear.system.contact_setup import ContactSetup, PhaseLaws
from fenwear.system.growing_grids import (
    answers_anywhere,
    at_rim,
    carried,
    grows,
    kept_volume,
    node_maps,
    on_first_contact,
    on_nodes,
    on_sufficient_grid,
    outgrown,
    placed_on,
    regridded,
    relaid,
    with_room,
)
from fenwear.system.memory_estimate import Resources, setup_resources
from fenwear.system.placing import place, place_at_rest, place_case_bodies
from fenwear.system.strokes import Clock, PlacedSliding, Sliding, make_sliding
from fenwear.system.surface_creep import Creep, CreepStage
from fenwear.system.tribosystem import (
    Condensed,
    ElasticContact,
    Preparation,
    Tribosystem,
    elastic,
    expansions,
    friction_power,
    heating_friction,
    heating_frictions,
    isothermal,
    joined,
    layer_conductance,
    led,
    preparation,
    resources_of,
    steady_exchange,
    with_exchange,
    with_reduced_heat,
)
from fenwear.system.variants import (
    assemble,
    in_parts,
    place_case,
    properties_outdated,
    property_change,
    renewed,
    set_up_by,
    taken_at,
    vary,
    warmed_system,
    warming_key,
    with_case,
)

__all__ = [
    "Bodies",
    "Clock",
    "Condensed",
    "ContactLaw",
    "ContactSetup",
    "Creep",
    "CreepStage",
    "ElasticContact",
    "PhaseLaws",
    "PlacedSliding",
    "Preparation",
    "Resources",
    "Sliding",
    "Tribosystem",
    "answers_anywhere",
    "assemble",
    "at_rim",
    "build_bodies",
    "build_conduction",
    "carried",
    "elastic",
    "elastic_body",
    "expansions",
    "friction_power",
    "grows",
    "heating_friction",
    "heating_frictions",
    "in_parts",
    "isothermal",
    "joined",
    "kept_volume",
    "law_named",
    "layer_conductance",
    "led",
    "make_sliding",
    "node_maps",
    "on_first_contact",
    "on_nodes",
    "on_sufficient_grid",
    "outgrown",
    "place",
    "place_at_rest",
    "place_case",
    "place_case_bodies",
    "placed_on",
    "preparation",
    "properties_outdated",
    "property_change",
    "register_contact_law",
    "regridded",
    "relaid",
    "renewed",
    "resources_of",
    "set_up_by",
    "setup_resources",
    "steady_exchange",
    "taken_at",
    "vary",
    "warmed_system",
    "warming_key",
    "with_case",
    "with_exchange",
    "with_reduced_heat",
    "with_room",
]
