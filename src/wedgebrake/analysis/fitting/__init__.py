"""Fit the parameters of a system to a measured trace and measured numbers.

trace        measured columns over time, from a Dataset, a DataFrame, a mapping or a file
trace_files  files of traces, by suffix
numbers      numbers measured in addition to a trace or instead of one
observation  which quantity of the model each column measures
model        prediction of the columns and its derivatives with respect to the free parameters
guess        states at the starts of segments, from measured angles and speeds
segments     prediction in segments, each simulated from its own state
features     starting values, from features of the trace
estimate     least squares of one run, and its loss; values, covariance, what is determined
shooting     fits in segments: multiple shooting
constrained  least squares under constraints
filters      delays and low-pass filters of columns, from the residuals
times        errors of the times of a trace, from the residuals
fit          ``fit`` and its result, with remarks on the trace
"""
