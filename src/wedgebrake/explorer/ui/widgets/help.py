"""The help of the page: what each of its parts shows, and its limits."""

from wedgebrake.explorer.core.limits import FINE_MAP, FINE_POINTS, MOST_PERIODS
from wedgebrake.explorer.core.verdict import STICK_SLIP

_TEXTS = {
    "Parameters": "A driveline with a self-amplified brake under a periodic torque. Move a slider,"
    " type a number, or choose another brake or friction law.",
    "Verdict": "Linear stability of sliding, self-locking, classes of motion and of stick-slip,"
    " and the brake torque. Hover over a tile for the evidence.",
    "Time history, phase portrait": "The last periods of the torque. Stick phases are coloured by"
    " the direction of sliding before them.",
    "Spectrum, Poincaré section": "Frequencies in the velocity, and the state once in every period"
    " of the torque; without a torque, where the velocity crosses the middle of its range upwards.",
    "Stick-slip, Hopf bifurcation": f"{STICK_SLIP} At a Hopf bifurcation steady sliding loses its"
    " stability: the damping of small vibration is 0, and beyond the limit vibration grows.",
    "Brake torque": "Over the sliding velocity, in both directions: a self-amplified brake is"
    " strong forwards and weak backwards. The dot is the instant shown by the brake. Sliding is"
    " unstable where the curve falls more steeply than the dashed line, of slope −c.",
    "Brake": "The brake in motion. Drag the bar below it through time.",
    "Diagram, regimes, stability, basins, amplitudes": "The motion over one or two parameters or"
    " over initial states; amplitudes of stable (solid) and unstable (dashed) orbits. Click in a"
    " plot to go there; turn the wheel to zoom, drag to move, and press the"
    " button at the right to see the whole again.",
    "Measured": "A measured trace (CSV) together with the motion of the machine. Parameters can be"
    " fitted to the trace, and the fitted values applied to the machine.",
    "Limits": "One degree of freedom; the brake has neither mass nor elasticity. Linear stability"
    " takes friction as constant over speed, except at the speed of a turning shaft. A run here has"
    f" at most {MOST_PERIODS} periods of the torque, a diagram {FINE_POINTS} values, a map"
    f" {FINE_MAP[0]} × {FINE_MAP[1]} cells; the Python library and the command line allow more.",
}
_LIST = "".join(f"<dt>{term}</dt><dd>{words}</dd>" for term, words in _TEXTS.items())
HELP = f"<details><summary>Help</summary><dl>{_LIST}</dl></details>"
