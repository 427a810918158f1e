"""A machine as numbers, for the exact solver of any number of inertias and contacts.

Between events the machine is x' = A x + B u(t) + b, with the state x = (angles, speeds, actuator
states), the signals u and a mode of each contact. A linear quantity of the machine is a row of
factors of z = (x, u, 1).
"""

from typing import Any, NamedTuple


from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.signals import Signals

# A contact between inertia ``a`` and inertia ``b`` (-1: ground or a moving base).
#
# base, base_rate : signals of the base's speed and acceleration; -1: none
# force           : signal of the actuation force at rest
# slope           : of the force against the sliding speed
# lag             : order of the actuator's lag, 0 to 2; its first state is ``state``
# lag_time, lag_frequency, lag_damping : its parameters
# lowest, highest : limits of the force, the release among them
# forward, backward, breakaway_forward, breakaway_backward : R g(m), at +-mu_k and +-mu_s
# lines           : the torque is that of ``lines_forward`` and ``lines_backward`` lines from
#                   ``first_line`` on instead, as friction depends on the speed
# sample_time, resolution, delay : of a digital controller; sample_time 0: none
CONTACT = record(
    "slope lag_time lag_frequency lag_damping lowest highest forward backward breakaway_forward"
    " breakaway_backward sample_time resolution",
    whole="a b base base_rate force lag state lines first_line lines_forward lines_backward delay",
)

STICK, SLIP = 0, 1
# Mode of a contact. side: direction of sliding, 0 in a stick; line: of the torque over the speed;
# clip: -1 or 1 where the force is at a limit; clamp: -1 or 1 where a stick has its largest torque,
# since others hold the rest; fresh: bits of the guards that it has just been at, by ``bit``.
MODE = record("held", whole="side line clip clamp fresh samples")

# A guard of a mode: a linear quantity that is positive inside. sign: what it watches is below or above.
GUARD = record(whole="contact kind sign")


class MachineProblem(NamedTuple):
    """The numbers of a machine.

    inverse     : (n,) one over the inertias
    stiffness, damping : (n, n) of the shafts
    drive       : (n, signals) torque on each inertia by each signal
    contacts    : of dtype ``CONTACT``
    lines       : of dtype ``piecewise_linear.LINE``, of all contacts
    states      : number of states
    """

    inverse: Any
    stiffness: Any
    damping: Any
    drive: Any
    contacts: Any
    lines: Any
    signals: Signals
    states: int
    start_time: float
