"""The server of UM-Bridge's protocol: what it answers, and what it refuses."""

from __future__ import annotations

import json
import threading
import urllib.request
from collections.abc import Callable, Iterator
from typing import Any
from urllib.error import HTTPError

import numpy as np
import pytest

from fenwear import Case, CaseError, load_case
from fenwear.life.server import Forward, RefusedError, _listening, answer, forward

FEW = ("geometry.parameters.elements_along_contact=4", "geometry.degree=2", "run.half_cycles=20")
KEYS = ("wear.punch.coefficient", "contact.friction")


@pytest.fixture(scope="module")
def model() -> Forward:
    """Return volume and largest steady pressure of Example 2 over coefficients of wear and friction."""
    return forward(load_case("example2", FEW), ["volume", "steady pressure"], KEYS)


@pytest.fixture
def address(model: Forward) -> Iterator[str]:
    """Return where a server listens."""
    with _listening(model, "127.0.0.1", 0, lambda _: None) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def asked(address: str, path: str, **request: Any) -> Any:
    """Return the answer to a request."""
    body = json.dumps({"name": "forward", **request}).encode()
    with urllib.request.urlopen(urllib.request.Request(f"{address}{path}", body)) as found:
        return json.load(found)


def test_values_and_derivatives_are_those_of_the_case(model: Forward) -> None:
    """The worn volume is beta~ F s, its elasticity to beta~ is 1; friction does not change it."""
    at = [4e-8, 0.25]
    (values,) = answer(model, "/Evaluate", {"name": "forward", "input": [at]})["output"]
    assert values[0] == pytest.approx(4e-8 * 10e3 * 20 * 3.0, rel=1e-9)
    gradient = answer(model, "/Gradient", {"name": "forward", "input": [at], "sens": [1, 0], "outWrt": 0, "inWrt": 0})
    assert gradient["output"] == pytest.approx([values[0] / at[0], 0.0], rel=1e-5, abs=1e-6)
    along = answer(model, "/ApplyJacobian", {"name": "forward", "input": [at], "vec": [0, 1]})["output"]
    assert along[0] == pytest.approx(0.0, abs=1e-6)
    assert np.isfinite(along[1])


def test_protocol_over_http(address: str) -> None:
    """As a client asks: what there is, its sizes, and a value."""
    with urllib.request.urlopen(f"{address}/Info") as found:
        assert json.load(found) == {"protocolVersion": 1.0, "models": ["forward"]}
    assert asked(address, "/InputSizes", config={}) == {"inputSizes": [2]}
    assert asked(address, "/OutputSizes", config={}) == {"outputSizes": [2]}
    assert asked(address, "/ModelInfo")["support"] == {
        "Evaluate": True,
        "Gradient": True,
        "ApplyJacobian": True,
        "ApplyHessian": False,
    }
    (values,) = asked(address, "/Evaluate", input=[[4e-8, 0.1]], config={})["output"]
    assert values[0] == pytest.approx(0.024, rel=1e-9)


def test_client_of_umbridge(address: str) -> None:
    """Where the package is installed."""
    umbridge = pytest.importorskip("umbridge")
    model = umbridge.HTTPModel(address, "forward")
    assert model.get_input_sizes() == [2]
    assert model([[4e-8, 0.1]])[0][0] == pytest.approx(0.024, rel=1e-9)
    assert model.supports_gradient()


@pytest.mark.parametrize(
    ("path", "request_", "kind"),
    [
        ("/Evaluate", {"name": "other"}, "ModelNotFound"),
        ("/Evaluate", {"name": "forward", "input": [[1.0]]}, "InvalidInput"),
        ("/Evaluate", {"name": "forward", "input": [[1.0, float("nan")]]}, "InvalidInput"),
        ("/Evaluate", {"name": "forward", "input": [["a", 1]]}, "InvalidInput"),
        ("/Evaluate", {"name": "forward", "input": [[-1.0, 0.25]]}, "CaseError"),
        ("/Gradient", {"name": "forward", "input": [[4e-8, 0.25]], "sens": [1]}, "InvalidInput"),
        ("/Gradient", {"name": "forward", "input": [[4e-8, 0.25]], "sens": [1, 0], "outWrt": 1}, "InvalidInput"),
        ("/ApplyHessian", {"name": "forward"}, "UnsupportedFeature"),
    ],
)
def test_bad_requests_are_refused(model: Forward, path: str, request_: dict[str, Any], kind: str) -> None:
    """Each by the protocol's word."""
    with pytest.raises(RefusedError) as refused:
        answer(model, path, request_)
    assert refused.value.kind == kind


def test_what_is_no_request_is_told_and_the_server_goes_on(address: str) -> None:
    """No JSON, a list, another path."""
    for body in (b"{", b"[1]", b"\xff"):
        with pytest.raises(HTTPError) as error:
            urllib.request.urlopen(urllib.request.Request(f"{address}/Evaluate", body))
        assert json.load(error.value)["error"]["type"] == "InvalidInput"
    assert asked(address, "/InputSizes") == {"inputSizes": [2]}


def test_bad_quantities_keys_and_ports_are_named(model: Forward) -> None:
    """By their options."""
    case: Case = model.case
    reasons: list[tuple[Callable[[], object], str]] = [
        (lambda: forward(case, ["width of moon"], KEYS), "--of"),
        (lambda: forward(case, ["depth"], ["contact.stickiness"]), "contact.stickiness"),
        (lambda: forward(case, ["depth"], []), "--to"),
        (lambda: _listening(model, "127.0.0.1", 70000, lambda _: None), "--port"),
    ]
    for make, key in reasons:
        with pytest.raises(CaseError, match=key):
            make()
