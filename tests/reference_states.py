"""States of the smoothed law known to 11 digits, shared by the tests of two solvers.

The paper's wedge brake (docs/equations.md, "The paper's parameters") from rest: alpha = 1.18,
f = 0.63, steepness 100 s/m, no static peak. Source: 128-bit Taylor integration split at every kink,
agreeing to 11 digits with DOP853 at 1e-13 split likewise.
"""

# (eta, F0): {time [s]: (angle [rad], velocity [rad/s])}
SMOOTHED = {
    (-24.0, 0.036): {
        1.0: (-0.04204623324574321, 7.688088080022293),
        5.0: (0.05702278894799761, 9.597838306935030),
        25.0: (-0.1144411511412534, 0.7053345407643287),
    },
    (-60.0, 0.036): {
        1.0: (-0.02672226415322319, 9.117131248784620),
        5.0: (0.07835910862885165, 8.849197986676899),
        25.0: (-0.1036210228336382, 1.329621777668845),
    },
    (0.0, 0.09): {
        1.0: (-0.02350190997126162, 0.09807903070489082),
        5.0: (-0.02107716577520335, 0.2120136356332346),
        25.0: (-0.008687446227120236, -0.3315865044525753),
    },
}
