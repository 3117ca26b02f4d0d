"""The laws of sliding: motion, friction and wear.

`friction.ContactConditions` has the variables of coefficients, `local_laws.Wear` the wear of a pressure. They
are asked in every phase of gross sliding (`fenwear.cycle.phase`) and every time step of partial slip
(`fenwear.stick.losses`).
"""
