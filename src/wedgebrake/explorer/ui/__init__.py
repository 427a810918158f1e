"""The page of the explorer: server, session, widgets and plots (Panel and Bokeh)."""
