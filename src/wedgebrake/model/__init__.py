"""The machine, and the study file that describes it.

One inertia:

driveline, brakes, friction, stribeck, actuation, excitation
                 the parts, immutable, in SI units
system           BrakedDriveline, all parts together
groups           the paper's normalised groups, both ways
characteristic   brake torque over velocity, the only input of the exact solver
paper_machines   the machines of the paper as data

Several inertias:

machine          Machine, all parts together
machine_parts    inertias, shafts, contacts and torques
machine_matrices how shafts and contacts join the inertias
machine_names    dotted names of parameters, such as "brake.slope"
driveline_names  names of a driveline in errors about its machine
signals          torques, forces and speeds as functions of time (signal_base: their base class)
signal_tables    tables and ramps
signal_calculus  phases, common periods, sums and integrals of signals
discs            discs heated by a contact

Common to both:

part             the base of the parts, and `parameter`, which states one of their fields
validation       the checks of all arguments, by pydantic, and the form of the messages
units            numbers with units as text, such as "22 deg"

Study files and results:

study            a system as a file, with its run (tables: which part is which table)
machine_study    the tables of a machine; records: CSV files that they name
study_run        the [run] table; study_schema: the JSON schema of study files
study_tables     the tables of a study file as a system, a run and a sweep
study_text       a study as text (toml: reading and writing)
sweep_settings   the parameters that can be swept, and the [sweep] table of a study
display          results in a terminal and a notebook
files            files, written completely or not at all; datasets as netCDF-4
examples         the example study files
"""
