"""Friction heat: conduction in the bodies, the heat between them, and its reduced form."""
