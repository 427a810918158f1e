"""Systems whose parameters vary, and where to begin the search for their orbits.

problem            base class
driveline_problem  one inertia
machine_problem    machines
choose_problem     the problem of a system
"""
