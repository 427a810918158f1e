"""Sweeps of many systems: bifurcation diagrams, regime maps, basins of attraction.

grid          swept parameters by SI name, group or initial condition; chunks and batches of points
plan          the complete definition of a sweep
chunk         computation of its points in batches; part_rows: the systems as tables of numbers
executor      threads of this machine;  cluster: workers of Dask
results       variables of the result: names, units, meanings
sweep         ``sweep``, in memory or into a store; ``bifurcation`` and ``regime_map``
scatter       ``scatter``: samples of distributions along one dimension, and probabilities
sampling      Sobol points, distributions and their correlation
outcomes      outcomes of samples: linear stability, stick-slip, limits; their probabilities
margin        ``margin``: values of a parameter for which a criterion holds
rare_event    ``rare_event``: small probabilities by line sampling
sobol_indices Sobol indices: the share of the variance due to each parameter
basins        ``basins``, with motions grouped by their attractors
store         a zarr folder from which an interrupted sweep can be resumed
store_format  its arrays and attributes, and the xarray engine that reads it
progress      points, rate and time left
"""
