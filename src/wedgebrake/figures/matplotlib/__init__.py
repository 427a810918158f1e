"""Pictures: one file per kind, and what they share. Matplotlib is imported when one is drawn.

Of one response:

history      velocity and torque against time, sticks shaded
phase        phase portrait with switching line, release speeds and sticks
section      Poincare section
spectrum     amplitude spectrum
overview     these four on one page, with what was computed in the title

Of a sweep:

bifurcation  Poincare points against a parameter, with classes of motion and of stick-slip
regime       map over two parameters: class of motion, or any other result
basins       basins of attraction, with the attractors

Of periodic orbits:

orbits       branches over a parameter, stable and unstable, with their bifurcations
boundary     bifurcations over two parameters, alone or over a map
labels       letters beside symbols, clear of all else

Of sliding:

stability    linear stability over two groups, with lines of equal margin

In and out:

draw         ``plot(dataset)``: the picture that suits a dataset
figure       class of the figures: display in notebooks, ``savefig``
save         file with a given width in pixels, for the command line

What pictures of sweeps share:

page         the figure: panels, legends below, caption above
caption      the words of the caption: machine, method, protocol
cells        swept parameters as axes, and cells of colour about their values
branches     the branches of a sweep that follows its points up and down
record       what a bifurcation diagram shows, as arrays
density      its points, shaded by how many lie where
strips       its strips of classes
looks        colours and words of the classes of motion, stick-slip and attractors

What all pictures share:

style        colours, symbols, sizes and type

Each kind has a function of its own name (``regime_map`` in regime) that gives a
``matplotlib.figure.Figure``, and, where one pair of axes is enough, ``draw(axes, ...)`` for
axes of your own. Nothing here touches pyplot.
"""
