"""Results as CSV tables and MATLAB files."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest
from scipy.io import loadmat

import wedgebrake as wb
from wedgebrake.model.exports import content

MACHINE = wb.load_study("examples/driveline.toml").system


def table(dataset):
    lines = content(dataset, ".csv").decode().splitlines()
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    values = np.array([[float(one) for one in row] for row in rows[1:]])
    return {name: values[:, i] for i, name in enumerate(rows[0])}


@pytest.fixture(scope="module")
def response():
    return wb.simulate(MACHINE, 0.5, samples=300)


@pytest.fixture(scope="module")
def swept():
    return wb.sweep(wb.paper.system(), {"eta": [-20.0, -10.0], "F0": [0.05, 0.1, 0.2]})


class TestTables:
    def test_of_a_machine_name_the_parts(self, response):
        found = table(response)
        assert np.array_equal(found["time [s]"], response["time"])
        for name in MACHINE.inertia_names:
            assert np.array_equal(
                found[f"velocity {name} [rad/s]"], response["velocity"].sel(inertia=name)
            )
        assert np.array_equal(
            found["brake_torque brake [N m]"], response["brake_torque"].sel(contact="brake")
        )

    def test_of_a_sweep_have_a_line_for_each_point(self, swept):
        found = table(swept)
        eta, force = np.meshgrid([-20.0, -10.0], [0.05, 0.1, 0.2], indexing="ij")
        assert np.array_equal(found["eta [1]"], eta.ravel())
        assert np.array_equal(found["F0 [1]"], force.ravel())
        assert np.array_equal(found["motion [1]"], swept["motion"].to_numpy().ravel())


@pytest.mark.parametrize("name", ["response", "swept"])
def test_matlab_files_have_all_variables(name, request):
    dataset = request.getfixturevalue(name)
    found = loadmat(io.BytesIO(content(dataset, ".mat")), squeeze_me=True)
    for one, variable in dataset.variables.items():
        values = np.array(variable.to_numpy().tolist())
        assert np.array_equal(found[one], np.squeeze(values), equal_nan=values.dtype.kind == "f")
    units = found["units"]
    coordinate = "time" if name == "response" else "eta"
    assert str(units[coordinate]) == dataset[coordinate].units
