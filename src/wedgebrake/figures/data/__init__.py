"""Contents of pictures as plain data, computed once and drawn by Matplotlib or Bokeh.

motion          one response: history, phase portrait, Poincaré section, spectrum
torque_curve    brake torque over the sliding velocity, in both directions
time_panels     all parts of a response over time, with their sticks
sketch          bodies and parts of a machine, and what joins them
modes           shapes of small vibration of a machine
bifurcation     bifurcation diagram: points, classes and exponents over one parameter
response_diagram amplitudes over one parameter, up and down
speed_limits    limits of linear stability over the speed or one parameter
class_map       map over two parameters: class of motion, any other result, linear stability
basins          basins of attraction, with the attractors
response_curve  amplitudes and phases of periodic orbits, by levels
orbit_branches  branches of periodic orbits, with their bifurcations
scatter         probabilities of outcomes, Sobol indices, samples by class
stopping, order_map  measures of a stop; amplitudes over speed and order
parts           one inertia and one contact of a response or a sweep
trace           a measured trace beside the motion of the machine on the page
partial         pictures of the page, complete or in part

Shared by all:

class_styles    colours, lines and words of classes, orbits and bifurcations; legends
panels          curves that share axes
caption         machine, method and run settings in words
axes            the range of a parameter, and the swept parameters of a dataset, as axes
stability_limit the limit of linear stability over two parameters
limits          ends of axes, and thinning of long lines
"""
