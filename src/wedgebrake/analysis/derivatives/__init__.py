"""Derivatives with respect to parameters of a system.

sensitivity      ``sensitivity``: derivatives of a response, or of numbers that describe a run
task             checked names of parameters, and the run that is to be differentiated
coincidences     one-sided derivatives where the order of coincident events changes
moved_samples    one-sided derivatives at samples whose times change
varied_values    quantities of parts with their derivatives, such as torques of shafts
varied_response  variables of a response at the samples of a run, with their derivatives
varied_motion    motion and its derivatives at the nodes of series between the events
measures         numbers that describe a run, such as heat and peaks, and their derivatives
measures_beside  derivatives of these numbers on one side of a value, from runs beside it
observables      further ones, which need not exist: periods, stick times, harmonics, orders
results          datasets of derivatives
"""
