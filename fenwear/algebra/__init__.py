"""Numerical algebra without any physics: assembled matrices, factors, Krylov methods, complementarity, fixed points."""
