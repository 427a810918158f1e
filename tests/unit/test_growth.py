"""Growth of deviations from products of matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wedgebrake.analysis.growth import growths


@pytest.mark.parametrize("size", [1, 2, 3, 4, 7, 11])
def test_volumes_grow_by_the_determinant(size) -> None:
    matrices = np.random.default_rng(size).normal(size=(40, size, size))
    found = growths(matrices)
    _, logarithms = np.linalg.slogdet(matrices)
    assert found.sum(axis=1) == pytest.approx(logarithms, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("size", [2, 3, 5])
def test_frames_follow_the_product_of_the_matrices(size) -> None:
    """Sums of growths are those of a volume under the product, from LAPACK."""
    rng = np.random.default_rng(7 + size)
    matrices = rng.normal(size=(6, size, size))
    start = np.cos(np.arange(size * size).reshape(size, size) ** 2)
    frame = np.linalg.qr(start)[0]
    whole = np.linalg.multi_dot(matrices[::-1]) @ frame
    expected = np.log(np.abs(np.diag(np.linalg.qr(whole)[1])))
    assert growths(matrices).sum(axis=0) == pytest.approx(expected, rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("size", [4, 6])
def test_exponents_of_a_constant_map_are_its_eigenvalues(size) -> None:
    """Every direction is found, also of more than three."""
    rng = np.random.default_rng(size)
    shapes, factors = rng.normal(size=(size, size)), 2.0 ** -np.arange(size)
    matrix = shapes @ np.diag(factors) @ np.linalg.inv(shapes)
    found = growths(np.tile(matrix, (80, 1, 1)))[60:].mean(axis=0)
    assert found == pytest.approx(np.log(factors), abs=1e-4)


def test_lost_directions_have_no_growth() -> None:
    rng = np.random.default_rng(3)
    matrices = rng.normal(size=(5, 4, 2)) @ rng.normal(size=(5, 2, 4))
    found = growths(matrices)
    assert np.all(np.isfinite(found[:, :2]))
    assert np.all(found[:, 2:] == -math.inf)
