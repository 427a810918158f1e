"""Derivative of the equations of an orbit of segments with respect to parameters, as a kernel.

A slip obeys a linear equation of motion. If its numbers change, the deviation from it obeys the
same equation, driven by these changes; variation of constants gives the deviation at the end as an
integral of the free motion of the piece, see ``linear_flow.impulse``. Gauss-Legendre quadrature
computes it to rounding, and without cancellation also for slips whose length is zero.
"""
