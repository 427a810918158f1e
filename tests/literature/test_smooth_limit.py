"""The smoothed law tends to Coulomb's as it gets steeper: two solvers, one limit.

At a reversal tanh(x v_r) and sign(v_r) differ by an area of 2 ln 2/x; on leaving rest the
smoothed motion is ahead until exp(-2 x v_r) is small, by v_r of the size of ln(x)/x. So the
difference is of first order in 1/x, up to that logarithm: measured from x = 1e3 to 1e6, the
order of error/ln(x) is 0.97 to 1.04 and tends to 1, while the order without it is 0.8 to 0.96.
The cases are those whose motion does not amplify a difference without bound.
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
    shrunk = np.array(errors) / np.log(STEEPNESS)
    orders = np.log10(shrunk[:-1] / shrunk[1:])
    assert orders == pytest.approx([1.0, 1.0], abs=0.1)
    assert abs(orders[1] - 1.0) <= abs(orders[0] - 1.0)
    assert errors[-1] <= 1e-3
