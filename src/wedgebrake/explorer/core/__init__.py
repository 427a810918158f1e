"""State and computations of the explorer, without Panel or Bokeh."""
