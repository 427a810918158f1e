"""The machine, and the study file that describes it.

One inertia:

driveline, brakes, friction, stribeck, actuation
                 the parts, immutable, in SI units
system           BrakedDriveline, all parts together
groups           the paper's normalised groups, both ways
characteristic   brake torque over velocity, the only input of the exact solver
paper_machines   the machines of the paper as data

Several inertias:

machine          Machine, all parts together
machine_parts    inertias, shafts, joints, contacts and torques
torque_contacts  one-way clutches and drag, which are contacts too
controller       feedback controllers
piecewise        piecewise-linear laws of torques over an angle or a speed
elements         the parts of a machine that have such a law
joints           how joints connect the bodies of a machine
machine_matrices how shafts and contacts join the inertias
machine_names    dotted names of parameters, such as "brake.slope"
discs            discs heated by a contact

Common to both:

system_base      System: what can be asked of both; own names in errors about the machine
view             how results of a machine are shown for a driveline
signals          torques, forces and speeds as functions of time
studies          study files
part             the base of the parts, and `parameter`, which states one of their fields
validation       the checks of all arguments, by pydantic, and the form of the messages
units            numbers with units as text, such as "22 deg"
display          results in a terminal and a notebook
files            files, written completely or not at all; datasets as netCDF-4
exports          results as netCDF-4, CSV tables and MATLAB files
"""
