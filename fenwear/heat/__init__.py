"""Friction heat: conduction in the bodies, the heat between them, and its reduced form.

Heat meets contact in `fenwear.cycle.thermal` and, with stick, in `fenwear.stick.heat`: both ask
`exchange.HeatExchange` for temperatures at the end of a step and for the gaps that they open.
"""
