"""Limits of the resources that one page may use (docs/explorer.md, "Limits")."""

from __future__ import annotations

MOST_PERIODS = 2000
"""Periods of the torque in one run."""
MOST_SHOWN = 100
"""Periods in the history and the phase portrait."""
SAMPLES_PER_PERIOD = 100
"""Samples of the response in a period of the torque."""
MOST_EVENTS = 200_000
"""Events of one run of the exact solver: about a second if each is slow to locate."""
MOST_STEPS = 400_000
"""Steps of one run of the other solvers: about a second, or three if each is slow."""
COARSE_POINTS, FINE_POINTS = 150, 600
"""Values of the parameter in a bifurcation diagram, at first and after refinement."""
COARSE_MAP, FINE_MAP = (24, 16), (96, 64)
"""Cells of a map of regimes or basins, at first and after refinement."""
LONGEST_STEP = 300
"""Time limit of one computation [s]; the page reports that it was exceeded."""
LONGEST_CURVE = 240
"""Time limit of all levels of an amplitude curve [s]; levels computed before it are shown."""
MOST_LEVELS = 8
"""Levels of an amplitude curve."""
MOST_TRACE = 64_000_000
"""Largest file of a measured trace [bytes], and the most that the page sends of any file."""
MOST_SAMPLES = 500_000
"""Samples of a measured trace."""
LONGEST_FIT = 240
"""Time limit of one fit [s]."""
LONGEST_EXPORT = 1800
"""Time limit of one export [s]."""
MOST_UPLOAD = 200_000
"""Bytes of a study file, so that any file is read within a fraction of a second."""
MOST_FILES = 4
"""Exports of one page in progress at a time."""
MOST_MESSAGE = 90_000_000
"""Bytes of one message of a browser, such as the largest file in base64, which has a third more.

Beyond this size the connection is closed.
"""
MOST_SESSIONS = 100
"""Pages that one server keeps open at a time."""
