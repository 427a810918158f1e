"""The explorer: a page where sliders move the machine and everything follows.

From the outside in:

server      one process that gives every browser a page of its own (``wedgebrake app``)
notebook    the same page in a notebook cell (``wb.explore``), served by its process
explorer    one page: what is heard changes the desk, what lies on it is computed and shown
parts/      what the browser draws and hears, one part of the page per file
parameter_plots  pictures over parameters: what is computed, with its Bokeh figure

What they work with, none of which knows a browser:

desk        a study and how it is looked at; every edit gives a new one
fields      the machine as rows of names, values and ranges
spans       the range of a parameter: of its slider and of pictures over it
presets     machines by name
calls       the run and the open picture as calls of public functions
filing      studies put on the desk, and what lies there made a study again
moment      the motion of a desk, as arrays and a verdict's numbers
judging     periods over which motions are classified
verdict     the verdict in words
export      pictures, data, study and program as files
snippet     the program that computes what is on the screen
turns       threads that take turns at the work of all pages; the newest wish wins
limits      what one page may ask for
"""
