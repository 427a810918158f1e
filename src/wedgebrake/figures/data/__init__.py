"""Contents of pictures as plain data, computed once and drawn by Matplotlib or Bokeh.

Of one motion:

history         velocity and torques over a span of time, with the sticks
phase           phase portrait with switching line, release speeds and sticks
section         Poincaré section
spectrum        amplitude spectrum with the forcing and the natural frequency
motion          class of the motions of these pictures

Over parameters:

bifurcation     bifurcation diagram: points, classes and exponents over one parameter
class_map       map over two parameters: class of motion, or any other result
basins          basins of attraction, with the attractors
stability       linear stability over two groups, with lines of equal margin
orbit_branches  branches of periodic orbits, with their bifurcations
codim2          curves of bifurcations over two parameters
partial         pictures of the page, as far as they are computed

What they share:

class_styles    colours and words of classes, attractors, orbits and bifurcations
legend          entries of legends
caption         machine, method and run settings in words
swept_axis      swept parameters of a dataset as axes
parameter_axis  the range of a parameter as an axis of the page
branches        branches of a sweep that follows its points up and down
stability_limit the limit of linear stability over two parameters
level_lines     lines along which values over two parameters have one level
sticks          sticks as intervals of time
limits          ends of axes, and thinning of long lines
"""
