"""Curved bodies that stick: what is alike on both sides comes out alike."""

from __future__ import annotations

import numpy as np
from cylinders import RADIUS, cattaneo, cylinders, line_load, on_flat, pressed, pulled

from fenwear.steps.stick_final import stick_edges, zone_width


def test_mirror_images_are_pressed_without_traction() -> None:
    """Whatever the friction: neither body is stretched more than the other, and the forces are upright."""
    interface = cylinders(0.68, 40)
    for friction in (2.0, 0.2):
        state, _ = pressed(interface, friction)
        force = interface.middle.in_space(np.concatenate([state.pressure, state.traction.T.ravel()]))
        assert np.abs(state.traction).max() < 1e-10 * state.pressure.max()
        assert np.abs(force[:, 0]).max() < 1e-10 * state.pressure.max()
        along = state.on_punch[:, 0]
        np.testing.assert_allclose(state.on_strip[:, 0], along, atol=1e-10 * np.abs(along).max())
        np.testing.assert_allclose(-along[::-1], along, atol=1e-10 * np.abs(along).max())


def test_traction_of_mirror_images_is_even_and_tends_to_that_of_half_planes() -> None:
    """An odd part would be locked in by the frame; what is left falls with a / R."""
    friction, share, errors = 0.2, 0.47, []
    for half_width in (0.68, 0.17):
        interface = cylinders(half_width, 40)
        pair = interface.middle.pair
        traction = pulled(interface, friction, share * friction * line_load(half_width))[0].traction[:, 0]
        assert np.abs(traction - traction[::-1]).max() < 1e-9 * traction.max()
        exact = cattaneo(pair.x, half_width, friction, share)
        errors.append(np.sqrt(pair.weights @ (traction - exact) ** 2 / (pair.weights @ exact**2)))
    assert errors[0] < 0.05
    assert errors[1] < 0.5 * errors[0]


def test_a_flat_strip_is_met_half_way() -> None:
    """A cylinder pressed on a flat: in the strip's frame the traction would be - p x / (2 R)."""
    interface = on_flat(0.34)
    state, _ = pressed(interface, 2.0)
    x, ratio = interface.middle.pair.x / RADIUS, state.traction[:, 0] / np.maximum(state.pressure, 1e-9)
    inner = np.abs(interface.middle.pair.x) < 0.17
    assert abs(np.polyfit(x[inner], ratio[inner], 1)[0]) < 0.1


def test_the_stick_zone_is_located_within_its_element() -> None:
    """c = a sqrt(1 - Q / (mu P)) of mirror images, within what is told on every mesh; a node's width would not do."""
    friction, half_width = 0.2, 0.17
    for elements in (32, 48, 64):
        interface = cylinders(half_width, elements)
        x, spacing = interface.middle.pair.x, 3 * half_width / elements / 2
        for share in (0.35, 0.47, 0.6, 0.75):
            state, slid = pulled(interface, friction, share * friction * line_load(half_width))
            width, within = zone_width(stick_edges(x, state.closed & (slid == 0), slid, state.closed))
            exact = 2 * half_width * np.sqrt(1 - share)
            assert abs(width - exact) < within
            assert within < 0.51 * spacing
