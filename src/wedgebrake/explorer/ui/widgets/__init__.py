"""The widgets of the page, one part per file; they show given values and report changes.

header          presets, files, friction law, comparison, activity, help;  help: its texts
parameters      sliders, inputs and choices of the system and its run
verdict_strip   the verdict in words and colour
brake_animation the brake in motion, drawn by the only script of the page
plot_tabs       plots over parameters, their ranges and legend
trace_panel     controls of a measured trace: file, columns, free parameters, fit
controls        design of the page, widgets with tooltips, and changes by the user
"""
