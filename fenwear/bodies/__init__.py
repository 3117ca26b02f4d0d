"""One body: its mesh, its elasticity, and its condensation onto the contact surface.

`distributed_mesh` finds the named groups, `supports` the motions that are left free, `contact_surface` the nodes
that can touch; how they answer to forces is an operator by name (`surface_operators`), by default the condensed body
(`condensation`).
"""
