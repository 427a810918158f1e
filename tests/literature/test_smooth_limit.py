"""The smoothed law tends to Coulomb's as it gets steeper: two solvers, one limit.

tanh(steepness v_r) differs from sign(v_r) by an area of 2 ln 2/steepness: wherever the motion
does not amplify that without bound, the error is of first order in 1/steepness.
"""

import numpy as np
import pytest

import wedgebrake as wb

STEEPNESS = (1e3, 1e4, 1e5)
CASES = {
    "wedge": {"eta": -60.0, "F0": 0.036},
    "wedge, steady actuation": {"eta": 0.0, "F0": 0.09},
    "conventional": {"eta": -24.0, "F0": 0.036, "brake": "conventional"},
    "conventional, steady actuation": {"eta": 0.0, "F0": 0.09, "brake": "conventional"},
}


@pytest.mark.parametrize("case", CASES)
def test_first_order_in_the_width_of_the_layer(case):
    exact = wb.paper.system(**CASES[case])
    truth = wb.simulate(exact, periods=10, samples_per_period=40)
    size = float(np.abs(truth.velocity).max())
    errors = []
    for steepness in STEEPNESS:
        smooth = exact.replace(friction=wb.SmoothedFriction(kinetic=0.3, steepness=steepness))
        # The integration error, 1e-10, is far below the difference of the laws, 1e-6.
        r = wb.simulate(smooth, periods=10, samples_per_period=40, rtol=1e-10)
        errors.append(float(np.sqrt(np.mean((r.velocity - truth.velocity) ** 2))) / size)
    orders = np.log10(np.array(errors[:-1]) / np.array(errors[1:]))
    print(case, errors, orders)
    assert orders[0] == pytest.approx(1.0, abs=0.2)
    assert orders[1] == pytest.approx(1.0, abs=0.05)
