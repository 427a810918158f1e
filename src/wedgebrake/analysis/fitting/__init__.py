"""Fit the parameters of a system to a measured trace and measured numbers.

trace        measured columns over time, from a Dataset, a DataFrame, a mapping or a file
trace_files  files of traces, by suffix
numbers      numbers measured in addition to a trace or instead of one
observation  which quantity of the model each column measures
model        prediction of the columns and its derivatives with respect to the free parameters
estimate     values, covariance, what is determined
segments     prediction of the columns in segments with their own initial states
constrained  least squares under constraints
shooting     estimate in segments, each of which continues the one before it
fit          ``fit`` and its result, with remarks on the trace
"""
