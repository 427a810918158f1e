"""Exact solution for set-valued friction: closed forms joined at located events.

solve                  a system and a task to a trajectory
trajectory             the loop: slip, stick, event, log
event_search           the first event in a linear piece, or the end of a stick
root_exclusion         the step that provably contains no event
"""
