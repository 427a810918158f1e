"""The explorer: an interactive page that shows the motion of a machine for any parameters.

notebook    the page in a notebook cell (``wb.explore``), served by its process

ui/         the page in the browser
  server          one process that gives every browser a page of its own (``wedgebrake app``)
  request_filter  filter of requests by path and host name; browsers open their pages in turn
  model_defaults  defaults of the properties of Bokeh's models, found once per class
  session         one page: edits change the current state; motion and plots follow
  page            its base: work in slots, results shown on the event loop
  widgets/        the widgets of the page, one part per file

core/       state and computations, independent of the browser
  state              the current study and its view; every edit returns a new state
  values             the values of a system by the names that ``replace`` takes
  units              units of values, also of those that depend on other parts
  fields             the system as rows of names, values and ranges; a parameter as an axis
  parameter_ranges   ranges of sliders and of plots
  presets            machines by name
  studies            study files loaded and saved
  computation        how motions are computed and classified, in one run and in sweeps
  snapshot           the motion, its class, and the contents of its charts
  verdict            the verdict in words
  class_texts        what it says of each class of motion
  one_part           the inertia and the contact of a response that the charts show
  formatting         numbers in inputs
  plots              plots over parameters, by progressive_sweep
  traces             measured traces: files, quantities of columns, ranges as text
  fits               the motion that is compared with a trace, and fits to the trace
  program            run and open plot as calls of public functions, and as a program
  export             charts, data, study and program as files
  scheduler          threads shared by all pages; newer jobs replace older ones
  limits             limits of one page
"""
