"""The class of motion by slow methods: what a fast classifier is measured by.

section      the stroboscopic map, by the exact solver
irregular    finite-separation exponent, weighted Birkhoff averages, 0-1 test
judge        the verdict
systems      the random systems, and systems as tables
named        cases chosen by hand, with what is known of them
make_truth   writes truth.json:  python -m tests.motion_truth.make_truth

No tangent space anywhere: neither saltation nor variational equations.
"""
