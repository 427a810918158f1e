"""Periodic orbits, stable or not: found, followed through parameters, and where they change.

shooting       an orbit near a guess, by Newton's method
chain, strobe  the equations of an orbit: exact (a chain of pieces), smooth (a map of periods)
family         the systems over one parameter, or two
arclength      a curve of solutions, step by step
margins        what ends a chain of pieces: the bifurcations that only friction has
transitions, beyond
               the chain beyond such an end, and the orbit on it
onset          of permanent sticking, in closed form
locate         fold, period doubling and the others, to rounding in the parameter
branch         one branch, point by point
branches       branches and those that leave them, as one dataset
stretches      from where to where a branch is stable
boundary       a bifurcation followed in a second parameter
"""
