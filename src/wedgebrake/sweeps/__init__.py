"""Many systems at once: bifurcation diagrams, regime maps, basins of attraction.

axes       what is swept, by SI name, group or initial condition
grid       the shape of a sweep, and how its points are shared out
plan       what is computed, whole
parts      the systems as tables of numbers
compute    the results of a chunk of points
workers    threads of this machine, or a Dask cluster
results    what is known of each point: names, units, words
run        ``sweep``: the front door, in memory or into a store
maps       ``bifurcation``, ``regime_map``, ``basins``
store      a zarr folder that survives a kill (store_layout, store_files, store_identity)
progress   points, rate and time left
"""
