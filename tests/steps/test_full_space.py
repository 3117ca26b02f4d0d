"""Contact with stick on all displacements of both bodies, nothing condensed: the same tractions, step by step."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from petsc4py import PETSc
from scipy.sparse import bmat, coo_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from fenwear import load_case
from fenwear.bodies.elasticity import ElasticBody
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import StickInterface, untouched
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import Imposed, TimeStepRecords
from fenwear_verify.full_space import nothing_condensed

MU = 0.5
CLOSE = 1e-8


def sparse(matrix: PETSc.Mat) -> csr_array:
    starts, columns, values = matrix.getValuesCSR()
    return csr_array((values, columns, starts), shape=matrix.getSize())


def reading(body: ElasticBody, shares: csr_array, along: np.ndarray) -> csr_array:
    """Return the displacement along given vectors (n, d) as the contact nodes see it, (n, dofs)."""
    part = csr_array(shares).tocoo()
    rows, nodes = part.coords
    d = body.dim
    columns = d * body.trace.blocks[nodes, None] + np.arange(d)
    values = part.data[:, None] * along[rows]
    return csr_array(coo_array((values.ravel(), (np.repeat(rows, d), columns.ravel())), (len(along), len(body.load))))


@dataclass
class FullSpace:
    """K_1 u_1 - J_1^T W f = l_1, K_2 u_2 + J_2^T W f = l_2, balance of rigid modes, and the two laws node by node.

    The jump of component k, normal or tangential, is J_1k u_1 - J_2k u_2 + H_k a - V_k delta. A semismooth
    Newton method in all of (u_1, u_2, f, a), f the pressures and then the tangential tractions.
    """

    interface: StickInterface

    def __post_init__(self) -> None:
        position, bodies = self.interface.middle, self.interface.bodies
        pair = position.pair
        self.n, self.d = pair.normal.shape
        frames = [position.frame[:, k] for k in range(self.d)]
        onto = [pair.punch.spread.T, pair.transfer]
        both = (bodies.punch, bodies.strip)
        self.J = [
            bmat([[reading(body, shares, e)] for e in frames]).tocsr() for body, shares in zip(both, onto, strict=True)
        ]
        self.K = [sparse(body.stiffness) for body in both]
        weights = diags_array(np.tile(pair.weights, self.d))
        self.C = []
        for body, J in zip(both, self.J, strict=True):
            free = np.ones(len(body.load))
            free[body.supported] = 0.0
            self.C.append(diags_array(free) @ J.T @ weights)

    def solve(self, old: np.ndarray, opening: np.ndarray, loads: list[np.ndarray], resultant: np.ndarray,
              displacement: float, start: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:  # fmt: skip
        """Return all tractions (d n,), the jumps without opening (d n,), and the Newton steps."""
        position, n, m = self.interface.middle, self.n, self.d - 1
        H, balance = csr_array(position.modes), csr_array(position.balance)
        c = 1 / np.abs(position.compliance.diagonal()).reshape(self.d, n)
        c[1:] = c[1]  # one number for both tangents of a node: else slip were not against its traction
        c = c.ravel()
        moved = -position.drive * displacement
        rest = np.concatenate([opening + moved[:n], moved[n:] - old[n:]])
        f, g = start.copy(), np.zeros(self.d * n)
        for iteration in range(1, 40):
            z = f - c * g
            closed, t = z[:n] > 0, z[n:].reshape(m, n)
            radius, size = MU * np.maximum(z[:n], 0), np.maximum(np.linalg.norm(t, axis=0), 1e-300)
            slips = closed & (size > radius)
            # Rows A f + B (jump + rest) = 0 of both laws.
            A, B = np.zeros((self.d, self.d, n)), np.zeros((self.d, self.d, n))
            A[0, 0], B[0, 0] = ~closed, closed * c[:n]
            for k in range(m):
                for j in range(m):
                    way = (k == j) - (t[k] / size) * (t[j] / size)
                    K = np.where(slips, radius / size * way, 0.0)
                    A[1 + k, 1 + j] = np.where(slips, (k == j) - K, (k == j) * ~closed)
                    B[1 + k, 1 + j] = np.where(slips, K, (k == j) * closed) * c[n + j * n : n + (j + 1) * n]
                A[1 + k, 0] = np.where(slips, -MU * t[k] / size, 0.0)
            rows_A, rows_B = (
                bmat([[diags_array(X[k, j]) for j in range(self.d)] for k in range(self.d)]) for X in (A, B)
            )
            system = bmat(
                [
                    [self.K[0], None, -self.C[0], None],
                    [None, self.K[1], self.C[1], None],
                    [rows_B @ self.J[0], -(rows_B @ self.J[1]), rows_A, rows_B @ H],
                    [None, None, balance, None],
                ]
            ).tocsc()
            right = np.concatenate([*loads, -(rows_B @ rest), -resultant])
            x = splu(system).solve(right)
            u = np.split(x, np.cumsum([len(loads[0]), len(loads[1]), len(f)]))
            before, f = f, u[2]
            g = self.J[0] @ u[0] - self.J[1] @ u[1] + H @ u[3] + rest
            if np.abs(f - before).max() < 1e-10 * np.abs(f).max():
                return (
                    f,
                    g - np.concatenate([opening, np.zeros(n * m)]) + np.concatenate([np.zeros(n), old[n:]]),
                    iteration,
                )
        raise AssertionError("the full system did not converge")


def compare(interface: StickInterface, radius: float, path: list[float]) -> None:
    """Press, then follow a path of displacements; every traction within CLOSE of the largest pressure."""
    full, bodies = FullSpace(interface), interface.bodies
    n = len(interface.middle.pair.weights)
    x = interface.middle.pair.punch.x
    opening = interface.middle.pair.initial_gap if radius == 0 else x[:, 0] ** 2 / (2 * radius)
    friction, loaded = np.full(n, MU), interface.loaded(None)
    start = Imposed(loaded.times(0), opening)
    state, old, f = untouched(interface), np.zeros(full.d * n), np.zeros(full.d * n)
    f[:n] = 1.0
    slipped = stuck = 0
    for displacement in [0.0, *path]:
        end = replace(start, loaded=loaded, displacement=displacement)
        state = advance(interface, state, start, end, friction)
        start = end
        loads: Any = [bodies.punch.load.copy(), bodies.strip.load.copy()]
        f, old, _ = full.solve(old, opening, loads, loaded.resultant, displacement, f)
        top = f[:n].max()
        assert state.pressure.max() == pytest.approx(top, rel=CLOSE)
        assert np.abs(state.pressure - f[:n]).max() < CLOSE * top
        assert np.abs(state.traction - f[n:].reshape(-1, n).T).max() < CLOSE * top
        slipped, stuck = slipped + int(state.slipping.sum()), stuck + int(state.sticking.sum())
    assert slipped > 3
    assert stuck > 3


def test_plane(unlike: Callable[[], StickInterface]) -> None:
    """Unlike blocks, there and back."""
    compare(unlike(), 200.0, [1e-3, 3e-3, 1e-3, -2e-3, 1e-3])


def cycles(name: str, *settings: str) -> tuple[TimeStepRecords, TimeStepRecords]:
    """Return the first cycle of a case by its condensed bodies, and with nothing condensed."""
    found = []
    for how in (nullcontext, nothing_condensed):
        with how():
            problem = partial_slip_problem(load_case(name, [*settings, "run.integration='explicit'"]))
            found.append(TimeStepRecords.joined(problem.cycle(problem.beginning())[1]))
    return found[0], found[1]


COARSE = ("geometry.parameters.elements_along_contact=8", "motion.amplitude='3 um'", "stick.steps=4")
SPHERE = ("geometry.parameters.across=2", "geometry.degree=1", "stick.steps=2", "stick.load_steps=1")


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("fretting-partial-slip", (*COARSE, "stick.force='60 N'", "motion.positions=3")),
        ("fretting-sphere", SPHERE),
    ],
)
def test_by_the_case(name: str, settings: tuple[str, ...]) -> None:
    """A whole cycle with nothing condensed, in as many Newton steps, with the same signs of determinants."""
    condensed, full = cycles(name, *settings)
    assert 0 < condensed.sticking.sum() < (condensed.pressure > 0).sum()
    assert (full.iterations == condensed.iterations).all()
    assert (full.unique == condensed.unique).all()
    for what in ("pressure", "traction", "slip", "gap", "force", "displacement", "strain", "stored", "dissipated"):
        one, other = getattr(condensed, what), getattr(full, what)
        assert np.abs(one - other).max() < CLOSE * np.abs(one).max()
