"""Analysis of systems, responses and motions.

linear_stability  damping, eigenvalues and bifurcation points of steady sliding
responses         measures of a response: spectrum, sticks, energy, stop, temperature
motion            ``motion``: class of the steady motion and its exponents
driveline_motion  motion of one inertia, by closed form
machine_motion    motion of any machine, by series; of one inertia, by stepper
poincare          ``poincare``: states at successive returns to a section
classify          class of a motion from its returns and the growth of deviations
invariant_curve   evidence of quasi-periodic motion
growth            growth of small deviations: exponents and multipliers
settling          end of an automatic transient
run_settings      transient and record of a run
sobol             Sobol points, for samples of parameters
fitting           ``fit``: parameters from a measured trace
derivatives       ``sensitivity``: derivatives with respect to parameters
evaluate          evaluation of a machine, with the kernel that fits the problem
"""
