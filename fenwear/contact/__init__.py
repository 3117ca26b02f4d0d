"""Contact as variational inequalities: on the condensed interface.

Which nodes touch, p >= 0, g >= 0, p g = 0, is decided in `inequality`; what a pressure does to gaps comes from
`fenwear.surfaces`. Wear that is implicit in the pressure is a part of the same system (`WearCompliance`).
"""

from fenwear.contact.condensed import CondensedContact, ContactSolver, ContactState, SlidingContact, WearCompliance

__all__ = ["CondensedContact", "ContactSolver", "ContactState", "SlidingContact", "WearCompliance"]
