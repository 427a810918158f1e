"""Contents of pictures as plain data, computed once and drawn by Matplotlib or Bokeh.

Of one motion:

history   velocity and torques over a span of time, with the sticks
phase     phase portrait with switching line, release speeds and sticks
section   Poincaré section
spectrum  amplitude spectrum with the forcing and the natural frequency

What they share:

sticks    sticks as intervals of time
limits    ends of axes, and thinning of long lines
"""
