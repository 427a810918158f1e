"""The class of motion by slow methods: what a fast classifier is measured by.

section      the stroboscopic map, by the exact solver
irregular    finite-separation exponent, weighted Birkhoff averages, 0-1 test
judge        the verdict
systems      the cases of truth.json, random ones and ones chosen by hand
make_truth   judges them again:  python -m tests.motion_truth.make_truth

No tangent space anywhere: neither saltation nor variational equations.
"""
