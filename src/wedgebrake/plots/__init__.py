"""Pictures: one file per kind. Matplotlib is imported when something is drawn.

history    velocity and torque against time, sticks shaded
phase      phase portrait with switching line, release speeds and sticks
section    Poincare section
spectrum   amplitude spectrum
overview   these four on one page, with what was computed in the title
save       to a file, whole or not at all
style      colours, sizes and type; the same in every picture

Each kind has ``draw(axes, ...)`` for axes of your own, and a function of its own name that
gives a ``matplotlib.figure.Figure``. Nothing here touches pyplot.
"""
