"""Events of a machine: the first one is found, and what follows it is decided.

cells            Taylor series, and the first zero of a condition, which is never passed
curves           series of torques that are curves over the sliding speed
products         series of torques over a state times a factor that varies in time
clock            the time, with the signals at this time
modes            the linear system and the conditions of a mode
controllers      outputs, limits and samples of feedback controllers
pieces           torques and changes of piecewise-linear elements
events           what changes at an event
arrivals         contacts that come to rest together
complementarity  which contacts hold, and which slip
coupled          contacts at rest of a machine with joints
reactions        torques of contacts that hold, also where they depend on each other
imposed          directions of sliding that last beyond their conditions
"""
