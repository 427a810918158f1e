"""Periodic orbits, stable or not: found, followed through parameters, and where they change.

What an orbit is:

equations      what the two ways to state it have in common
chain          exactly, as a chain of pieces (``segment_bvp_kernel``)
strobe         with smooth friction, as a map from period to period
flow           the exact flow over periods, from which chains are made
symmetry       orbits that are their own mirror image, or repeat before their time
orbit          one orbit, as it is told

How it is found and followed:

shooting       ``orbit``: near a guess, by Newton's method
family         the systems over one parameter, or two
curves         orbits over a parameter, and bifurcations over two, as curves in scaled unknowns
arclength      Newton's method and direction on a curve
point          a point of a branch, and which bifurcation it is
branch         one branch, point by point
known          whether an orbit is on a branch that is there already
switching      the branches that leave one
continuation   ``continuation``: the branch of an orbit
skeleton       all branches from the ends of a range
branches       ``branches``: them as one dataset
ranges         the parameter and its ends, checked
stretches      from where to where a branch is stable
dataset        branches as a dataset

Where it changes:

kinds          the bifurcations by name
locate         their place, to rounding
transitions    the chain of pieces beyond a bifurcation of friction
beyond         the orbit on it
onset          of permanent sticking, in closed form
boundary       ``boundary`` and ``boundaries``: bifurcations in two parameters
"""
