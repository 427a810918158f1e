"""Other programs that do the same work, in one file each.

brake          the wedge brake in plain numbers, and how long it rests
machine        a machine of several inertias in plain numbers
peer           their common interface
scipy_ode      SciPy's solve_ivp with a compiled right-hand side
heyoka_events  heyoka, one trajectory at a time, with terminal events
heyoka_machine heyoka on machines, with terminal events
heyoka_stops   heyoka on one inertia between two stops
heyoka_batch   heyoka, several trajectories in vector lanes, with terminal events
moreau         Siconos, Moreau time-stepping (moreau_steps runs under its Python)
xppaut         XPPAUT without a screen
octave         GNU Octave, lsode
auto           AUTO-07p, branches of periodic orbits
harmonic_balance  harmonic balance in NumPy, orbits over the frequency
"""

from peers.peer import Answers, Peer

__all__ = ["Answers", "Peer", "all_peers"]


def all_peers() -> list[Peer]:
    """Every peer, installed or not, in the order of the table."""
    from peers import heyoka_batch, heyoka_events, moreau, octave, scipy_ode, xppaut

    modules = (heyoka_events, heyoka_batch, scipy_ode, moreau, xppaut, octave)
    return [peer for module in modules for peer in module.peers()]
