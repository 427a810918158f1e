"""Trajectory of a machine: cell by cell, from event to event.

trajectory  the loop: cell, first event, log
stride      cells of equal length without events; stride_matrices: their matrices
follow      cells whose returns to a section, derivative and extremes are recorded
nodes       values of the quantities within a cell, and bounds of their extremes
extremes    extremes of a series on a cell
section     returns to a section
variation   derivative of the flow
resolution  cells in which it is resolved
observers   samples and work
watch       what is recorded of a passage
"""
