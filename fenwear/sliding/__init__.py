"""The laws of sliding: motion, friction and wear.

What a coefficient depends on in a state is `friction.ContactConditions`, what is worn by a pressure `wear.Wear`. They
are asked in every phase of gross sliding (`fenwear.cycle.phase`) and every time step of partial slip
(`fenwear.sliding.local_laws`).
"""
