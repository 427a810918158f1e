"""Pictures for files and notebooks. Matplotlib is imported when one is drawn.

motion          one response: history, phase portrait, Poincare section, spectrum, and an overview
time_panels     all parts of a response over time: speeds, sticks, torques and forces
sketch          bodies and parts of a machine
modes           shapes of small vibration of a machine, with frequency and damping
bifurcation     Poincare points against a parameter, with classes of motion and of stick-slip
response_diagram amplitudes against a parameter
speed_limits    limits of linear stability over the speed or one parameter
maps            over two parameters: regimes, basins, linear stability, curves of bifurcations;
                amplitudes over speed and order
scatter         probabilities of outcomes, Sobol indices, samples by class
fit             measured and fitted columns of a trace
stopping        measures of a stop
temperature     of a disc, over time
response_curve  amplitudes and phases of periodic orbits over one parameter, by levels
orbit_branches  periodic orbits over a parameter, stable and unstable, with their bifurcations

draw            ``plot(dataset)``: the picture for a kind of dataset
figure          class of the figures: display in notebooks, ``savefig``
save            file with a given width in pixels, for the command line

bands           diagrams over one parameter with the classes below
panels          curves that share axes
layout          pages, legends below, caption above; lines and markers
tick_labels     labels of ticks as plain text
point_labels    labels beside points, clear of all other content
style           colours, symbols, sizes and type

Each kind has a function of its own name (``regime_map`` in maps) that returns a
``matplotlib.figure.Figure``, and, where one pair of axes is enough, one that draws on given axes.
The contents come from ``wedgebrake.figures.data``. Nothing here uses pyplot.
"""
