"""Temperatures of a contact on a grid: friction heat of solved pressures in half-spaces, and what finite bodies add.

It follows from the pressures and does not act back on them: see `fenwear.flash.temperatures`.
"""
