"""Pictures: one file per kind. Matplotlib is imported when something is drawn.

history      velocity and torque against time, sticks shaded
phase        phase portrait with switching line, release speeds and sticks
section      Poincare section
spectrum     amplitude spectrum
overview     these four on one page, with what was computed in the title
bifurcation  Poincare points against a parameter, with classes of motion and of stick-slip
regime       map over two parameters: class of motion, or any other result
basins       basins of attraction, with the attractors
draw         ``plot(dataset)``: the picture that suits a dataset
save         to a file, whole or not at all
style        colours, sizes and type; the same in every picture

Each kind has a function of its own name (``regime_map`` in regime) that gives a
``matplotlib.figure.Figure``, and, where one pair of axes is enough, ``draw(axes, ...)`` for
axes of your own. Nothing here touches pyplot.
"""
