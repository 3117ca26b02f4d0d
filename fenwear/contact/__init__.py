"""Contact as variational inequalities: on the condensed interface, and on the full bodies."""

from fenwear.contact.condensed import CondensedContact, ContactSolver, ContactState, SlidingContact, WearCompliance
from fenwear.contact.full import FullContact

__all__ = ["CondensedContact", "ContactSolver", "ContactState", "FullContact", "SlidingContact", "WearCompliance"]
