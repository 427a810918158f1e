"""What the browser draws and hears: one part of the page per file, with its script and style.

page           where each part stands
header         presets, files, exact or smoothed, the ghost
machine        the machine's values, to be changed
verdict_strip  the verdict in words and colour
stage          the drawn brake in motion, and the scrubber
atlas          the pictures over parameters and what they go over
theme.css      colours, type and controls of all of them

A part shows what it is given and says what its user did; it computes nothing and knows no
other part.
"""
