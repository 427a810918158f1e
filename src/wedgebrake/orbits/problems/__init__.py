"""Systems whose parameters vary, and where to begin the search for their orbits.

problem              base class
one_inertia_problem  one inertia driven by a sine
machine_problem      machines
choose_problem       the problem of a system
"""
