"""The fixed-step scheme with which the paper was computed (Simulink's ODE14x).

simulate  ``ode14x``: arguments, checks and the response
scheme    the solution of a task
kernel    the compiled steps
"""
