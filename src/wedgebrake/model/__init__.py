"""The machine, and the study file that describes it.

driveline, brakes, friction, actuation, excitation   its parts, immutable and in SI
system           BrakedDriveline, all parts together
groups           the paper's normalised groups, both ways
characteristic   brake torque against velocity, all that the exact solver sees
part             the base of the parts, and `parameter`, which states one of their fields
validation       the checks of all arguments, by pydantic, and the form of the messages
study            the same machine as a file, with its run (tables: which part is which table)
study_text       a study as text (toml: reading and writing, files: complete or not at all)
sweep_settings   the parameters that can be swept, and the [sweep] table of a study
display          results in a terminal and a notebook
netcdf           datasets as netCDF-4
"""
