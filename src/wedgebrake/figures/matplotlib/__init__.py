"""Pictures: one file per kind, and what they share. Matplotlib is imported when one is drawn.

Of one response:

history      velocity and torque against time, sticks shaded
phase        phase portrait with switching line, release speeds and sticks
section      Poincare section
spectrum     amplitude spectrum
overview     these four on one page, with what was computed in the title

Of a sweep:

bifurcation     Poincare points against a parameter, with classes of motion and of stick-slip
regime          map over two parameters: class of motion, or any other result
basins          basins of attraction, with the attractors

Of periodic orbits:

orbit_branches  branches over a parameter, stable and unstable, with their bifurcations
codim2          bifurcations over two parameters, alone or over a map

Of sliding:

stability       linear stability over two groups, with lines of equal margin

In and out:

draw            ``plot(dataset)``: the picture that suits a dataset
figure          class of the figures: display in notebooks, ``savefig``
save            file with a given width in pixels, for the command line

Shared:

layout          the figure: panels, legends below, caption above
class_map       cells of colour over two axes, with the stability limit
density         points over a parameter, shaded by their number
point_labels    labels beside points, clear of everything else
legend          legend entries as artists
style           colours, symbols, sizes and type

Each kind has a function of its own name (``regime_map`` in regime) that returns a
``matplotlib.figure.Figure``, and, where one pair of axes is enough, ``draw(axes, ...)`` for
given axes. The contents come from ``wedgebrake.figures.data``. Nothing here uses pyplot.
"""
