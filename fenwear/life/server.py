"""Quantities of interest as a model that other programs ask over HTTP: a server of UM-Bridge's protocol.

UM-Bridge (L. Seelinger et al., J. Open Source Software 8, 2023) is what samplers, surrogates and optimisers of many
languages speak. The model takes one vector, the values of keys in their internal units, and gives one, the quantities;
its gradient and the product with its Jacobian are the sensitivities of `fenwear.life.sensitivity`.

The server of the package umbridge listens on every interface and calls its models from a thread of their own. This one
listens where it is told to, by default on the loopback interface, and computes in the main thread, one request after
the other, as MPI and PETSc want it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.errors import CaseError, FenwearError, InputError
from fenwear.life.keys import Key, find_key, with_values
from fenwear.life.model import Model
from fenwear.life.quantities import Quantity, evaluate, of_case, parse_quantity
from fenwear.life.sensitivity import sensitivity

NAME, PROTOCOL = "forward", 1.0
LONGEST = 2**20  # bytes of a request
KEPT = 64  # Jacobians


class RefusedError(Exception):
    """A request that cannot be answered, with the protocol's word for why."""

    def __init__(self, kind: str, message: str) -> None:
        self.kind = kind
        super().__init__(message)


@dataclass
class Forward:
    """Quantities of interest of a case as a function of its keys.

    Attributes:
        case: The case.
        quantities: What is wanted.
        keys: What they are functions of.
    """

    case: Case
    quantities: Sequence[Quantity]
    keys: Sequence[Key]
    _model: Model = field(init=False)
    _jacobians: dict[tuple[float, ...], Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._model = Model(self.case)

    def values(self, given: Sequence[float]) -> list[float]:
        """Return the quantities at values of the keys (k,).

        Raises:
            CaseError: a value is not possible.
            ConvergenceError: a run or a steady state did not converge.
        """
        return [evaluate(self._model, quantity, self._named(given))[0] for quantity in self.quantities]

    def jacobian(self, given: Sequence[float]) -> Array:
        """Return the derivatives of the quantities to the keys (quantities, keys).

        Raises:
            CaseError, ConvergenceError: as `values`.
        """
        at = tuple(given)
        if at not in self._jacobians:
            case = with_values(self.case, self._named(given))
            paths = [key.path for key in self.keys]
            found = sensitivity(case, self.quantities, paths, spread=0, comm=MPI.COMM_SELF)
            if len(self._jacobians) >= KEPT:
                self._jacobians.clear()
            self._jacobians[at] = np.array([[row.derivative for row in one.derivatives] for one in found])
        return self._jacobians[at]

    def _named(self, given: Sequence[float]) -> dict[str, float]:
        return {key.path: float(value) for key, value in zip(self.keys, given, strict=True)}


def forward(case: Case, quantities: Sequence[str], keys: Sequence[str]) -> Forward:
    """Return quantities of a case as a function of its keys.

    Raises:
        CaseError: one that the case does not have, or none.
    """
    for option, given in (("--of", quantities), ("--to", keys)):
        if not given:
            raise CaseError(InputError(option, "expected at least one"))
    wanted = [of_case(parse_quantity(text, names=case.names), case) for text in quantities]
    return Forward(case, wanted, [find_key(case, key, "--to") for key in keys])


def answer(model: Forward, path: str, request: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the protocol answers to a request.

    Raises:
        RefusedError: it asks for what there is not, or what is not possible.
    """
    if path == "/Info":
        return {"protocolVersion": PROTOCOL, "models": [NAME]}
    if request.get("name") != NAME:
        raise RefusedError("ModelNotFound", f"no model {request.get('name')!r}; there is {NAME!r}")
    sizes = {"/InputSizes": ("inputSizes", model.keys), "/OutputSizes": ("outputSizes", model.quantities)}
    if path in sizes:
        name, of = sizes[path]
        return {name: [len(of)]}
    if path == "/ModelInfo":
        able = ("Evaluate", "Gradient", "ApplyJacobian")
        return {"support": {**dict.fromkeys(able, True), "ApplyHessian": False}}
    ways = {"/Evaluate": _evaluate, "/Gradient": _gradient, "/ApplyJacobian": _apply_jacobian}
    if path not in ways:
        raise RefusedError("UnsupportedFeature", f"{path} is not supported")
    try:
        return {"output": ways[path](model, request)}
    except FenwearError as error:
        raise RefusedError(type(error).__name__, str(error)) from error


def _evaluate(model: Forward, request: Mapping[str, Any]) -> list[list[float]]:
    return [model.values(_input(model, request))]


def _gradient(model: Forward, request: Mapping[str, Any]) -> list[float]:
    """Return sens^T J."""
    sens = _vector(request, "sens", len(model.quantities))
    return [float(value) for value in np.array(sens) @ model.jacobian(_input(model, request))]


def _apply_jacobian(model: Forward, request: Mapping[str, Any]) -> list[float]:
    """Return J vec."""
    vec = _vector(request, "vec", len(model.keys))
    return [float(value) for value in model.jacobian(_input(model, request)) @ np.array(vec)]


def _input(model: Forward, request: Mapping[str, Any]) -> list[float]:
    given = request.get("input")
    if not isinstance(given, list) or len(given) != 1:
        raise RefusedError("InvalidInput", "expected one vector as input")
    for name in ("outWrt", "inWrt"):
        if request.get(name, 0) != 0:
            raise RefusedError("InvalidInput", f"{name}: expected 0, there is one vector")
    return _vector({"input": given[0]}, "input", len(model.keys))


def _vector(request: Mapping[str, Any], name: str, length: int) -> list[float]:
    given = request.get(name)
    whole = isinstance(given, list) and all(isinstance(v, int | float) and not isinstance(v, bool) for v in given)
    if not whole or len(given or ()) != length or not np.isfinite(given or ()).all():
        raise RefusedError("InvalidInput", f"{name}: expected {length} finite numbers")
    return [float(value) for value in given or ()]


def serve(model: Forward, host: str, port: int, log: Callable[[str], None]) -> None:
    """Answer requests until an interrupt.

    Args:
        model: What is asked for.
        host: Address to listen on.
        port: Of it; 0 for one that is free.
        log: Told where it listens, and of requests that are refused.

    Raises:
        CaseError: it cannot listen there, or there are several ranks.
    """
    if MPI.COMM_WORLD.size > 1:
        raise CaseError(InputError("serve", "expected one rank: requests reach one alone"))
    with _listening(model, host, port, log) as server:
        address = f"http://{server.server_address[0]!s}:{server.server_port}"
        log(f"UM-Bridge model {NAME!r} at {address}, until an interrupt")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            log("ended")


def _listening(model: Forward, host: str, port: int, log: Callable[[str], None]) -> HTTPServer:
    class Handler(BaseHTTPRequestHandler):
        """Reads a request, has it answered, writes the answer."""

        timeout = 60  # s that a request may take to arrive

        def do_GET(self) -> None:
            """Answer a request without a body."""
            self._answer({})

        def do_POST(self) -> None:
            """Answer a request in JSON."""
            try:
                length = int(self.headers.get("Content-Length", 0))
                if not 0 <= length <= LONGEST:
                    raise ValueError
                request = json.loads(self.rfile.read(length) or b"{}")
            except ValueError:
                request = None
            self._answer(request)

        def _answer(self, request: Any) -> None:
            try:
                if not isinstance(request, dict):
                    raise RefusedError("InvalidInput", "expected an object in JSON")
                status, found = 200, answer(model, self.path, request)
            except RefusedError as refused:
                log(f"refused {self.path}: {refused}")
                status, found = 400, {"error": {"type": refused.kind, "message": str(refused)}}
            body = json.dumps(found).encode()
            self.send_response(status)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  (its name)
            """Say nothing of requests that are answered."""

    try:
        return HTTPServer((host, port), Handler)
    except (OSError, OverflowError) as error:
        raise CaseError(InputError("--port", f"cannot listen on {host}:{port}: {error}")) from None
