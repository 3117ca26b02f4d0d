"""Friction heat: conduction in the bodies, the heat between them, its reduced form, moving sources.

Heat meets contact in `fenwear.steps.phase` and, with stick, in `fenwear.steps.stick_heat`: both ask
`heat_exchange.HeatExchange` for temperatures at the end of a step and for the gaps that they open.
"""
