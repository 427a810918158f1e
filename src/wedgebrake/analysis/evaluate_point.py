"""One system judged: run, settle, record, classify. The unit of work of every sweep.

No allocation: the caller lends the room, one set for each thread.
"""

import math

import numpy as np

from wedgebrake.analysis import accumulators as count
from wedgebrake.analysis.classify import SETTLED, classify, distance, mean_growth, rounding_of
from wedgebrake.analysis.saltation import carry, split
from wedgebrake.dynamics.enums import (
    AT_REST,
    BIDIRECTIONAL,
    COMPLETED,
    DIVERGED,
    LOCKED,
    LOG_FULL,
    NO_SLIDING,
    NO_SLIP,
    NON_STICK_SLIP,
    RUNAWAY,
    UNDECIDED,
    UNIDIRECTIONAL,
)
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import BLOCKED, G2, KIND
from wedgebrake.dynamics.piecewise_linear import CORNER, pieces_about
from wedgebrake.solvers.event_driven.trajectory import run

# Columns of the answer.
(
    OUTCOME,
    CLASS,
    ORDER,
    STICK_CLASS,
    STICKS_FORWARD,  # in a period of the torque
    STICKS_BACKWARD,
    STICK_SHARE,
    LARGEST_EXPONENT,  # [1/s]
    SECOND_EXPONENT,
    EXPONENT_ERROR,
    RETURN_DISTANCE,
    TRANSIENT,  # periods before the record
    PEAK_TORQUE,  # [N m]
    FRICTION_POWER,  # [W]
    SLIDING_DAMPING,  # [N m s/rad]
    EVENTS,
    FINAL_THETA,
    FINAL_W,
    SIZE,  # half the range of velocity and weighted angle, added [rad/s]
    SETTLING,  # periods after which the motion stayed at its final orbit
    JUDGED,  # periods that the class was judged on
) = range(21)
COLUMNS = 21

# Growth of the logarithm of a deviation in a period of the orbit that is no rounding.
_UNSTABLE = 1e-6

_pieces_about = compiled(pieces_about)

# Periods of the first window of an automatic transient; each next one is twice as long.
_FIRST = 64


@compiled
def _advance(problem, state, last, max_events, log, points, tally, deviation, growth, first):
    """Run to the start of period ``last``, adding up what passes.

    state     : (period, t, theta, w)
    points    : (periods + 1, 2), by period number
    deviation : (x1, y1, x2, y2), see ``tangent.carry``

    Returns (outcome, state, events, deviation, logdet, ranked, scale).
    """
    plant, laws = split(problem)
    x1, y1, x2, y2 = deviation
    period, t, theta, w = state
    logdet, ranked, scale, total = 0.0, True, 0.0, 0
    while True:
        outcome, period, t, theta, w, events, rows, _ = run(
            *problem, period, t, theta, w, last, 0.0, max_events - total, log,
            points[period + 1 : last + 1],
        )  # fmt: skip
        total += events
        count.add(plant, laws, log, rows, tally)
        x1, y1, x2, y2, part, full, more = carry(
            plant, laws, log, rows, x1, y1, x2, y2, growth, first
        )
        logdet += part
        scale += more
        ranked = ranked and full
        if outcome != LOG_FULL:
            state = (period, t, theta, w)
            return outcome, state, total, (x1, y1, x2, y2), logdet, ranked, scale


@compiled
def _weight(problem):
    """What turns an angle into a velocity: the natural frequency, or the torque's."""
    w2 = problem[2] / problem[0]
    return math.sqrt(w2) if w2 > 0.0 else problem[4]


@compiled
def _ruler(problem):
    """The same for distances: without a spring the angle does not matter."""
    return _weight(problem) if problem[2] > 0.0 else 0.0


@compiled
def _size(tally, weight):
    """Half the range of velocity and weighted angle together [rad/s]."""
    width = tally[count.HIGH_W] - tally[count.LOW_W]
    return 0.5 * (width + weight * (tally[count.HIGH_THETA] - tally[count.LOW_THETA]))


@compiled
def _fresh(weight):
    """A first deviation of length one in no special direction, and none."""
    return math.sqrt(0.5) / weight, math.sqrt(0.5), 0.0, 0.0


@compiled
def _monodromy(problem, state, order, max_events, log, points, growth, tally):
    """Logarithms of the moduli of both multipliers of a periodic orbit; -inf: rank lost.

    ``tally`` receives what one orbit adds up to.
    """
    weight = _weight(problem)
    count.clear(tally)
    outcome, _, _, deviation, logdet, ranked, scale = _advance(
        problem, state, state[0] + order, max_events, log, points, tally,
        (1.0, 0.0, 0.0, weight), growth[:0], state[0],
    )  # fmt: skip
    if outcome != COMPLETED:
        return math.nan, math.nan
    a, d = deviation[0], deviation[3] / weight
    half = 0.5 * (a + d)
    if not ranked:
        return math.log(abs(a + d)) + scale if a + d != 0.0 else -math.inf, -math.inf
    determinant = math.exp(logdet - 2.0 * scale)
    split = half * half - determinant
    # A double multiplier splits by the root of its rounding.
    if split <= 1e-13 * (half * half + determinant):
        return 0.5 * logdet, 0.5 * logdet
    first = math.log(abs(half) + math.sqrt(split)) + scale
    return first, logdet - first


@compiled
def attracts(first, returned, points, weight, size):
    """Whether a motion that returns to ``returned`` of its size is on an orbit to stay.

    first : logarithm of the largest multiplier. What is left to come is a geometric series
            of it, so that a slow passage by the ghost of an orbit, where it is almost 1, is
            not taken for one. What returns to rounding only must not be unstable.
    """
    if returned * size <= 10.0 * rounding_of(points, weight, size):
        return not first > _UNSTABLE
    share = math.exp(first)
    return share < 1.0 and returned * share <= SETTLED * (1.0 - share)


@compiled
def settling_of(points, order, last, weight, size):
    """Periods after which the motion stayed at its final orbit."""
    room = 10.0 * (SETTLED * size + rounding_of(points[: last + 1], weight, size))
    for k in range(last - order, -1, -1):
        if distance(points, k, last - (last - k) % order, weight) > room:
            return k + 1
    return 0


@compiled
def _rests(problem, tally, periods):
    """Whether a tally is all rest that lasts: on a turning shaft the spring ends it."""
    lasting = problem[11] == 0.0 or problem[2] == 0.0
    length = 2.0 * math.pi / problem[4]
    return lasting and tally[count.REST_TIME] >= periods * length * (1.0 - 1e-12)


@compiled
def _stick_class(tally, resting):
    if resting:
        return NO_SLIP
    forward, backward = tally[count.STICKS_FORWARD] > 0.0, tally[count.STICKS_BACKWARD] > 0.0
    if forward and backward:
        return BIDIRECTIONAL
    return UNIDIRECTIONAL if forward or backward else NON_STICK_SLIP


@compiled
def _sliding_damping(problem):
    """Damping of steady sliding as defined in ``linear_stability``; inf if there is none.

    Evaluated at the speed of a turning shaft (w = 0); otherwise near rest, the smaller value of
    both directions.
    """
    inertia, bounds, table, zero, w_rest = (
        problem[0], problem[5], problem[7], problem[8], problem[11],
    )  # fmt: skip
    turns = w_rest != 0.0
    first, last = zero - 1, zero
    if turns:
        first, last = _pieces_about(bounds, 0.0, CORNER * abs(w_rest))
    least = math.inf
    for piece in range(first, last + 1):
        if table[piece, KIND] != BLOCKED:
            least = min(least, table[piece, G2] * inertia)
        elif turns:
            return math.inf
    return least


@compiled
def next_window(done, limit):
    """End of the window after ``done`` periods: the last one is the second half of all."""
    target = max(2 * done, _FIRST)
    return limit if 2 * target > limit else target


@compiled
def _window_verdict(
    problem, state, begin, max_events, log, points, growth, tally, spare, logdet, ranked
):
    """What the periods from ``begin`` to the state's say.

    spare : receives what one orbit adds up to, where the motion repeats

    Returns (class, order, return distance, growth per period, its error, second growth).
    """
    ruler, end = _ruler(problem), state[0]
    count_ = end - begin
    size = _size(tally, ruler)
    window = points[begin : end + 1]
    area = logdet / count_ if ranked else -math.inf
    lasting = problem[11] == 0.0 or problem[2] == 0.0
    resting = lasting and tally[count.LAST_SLIP] <= end - 1.0
    class_, order, returned = classify(window, ruler, size, growth[:count_], area, resting)
    mean, error = mean_growth(growth[:count_])
    second = area - mean
    if class_ == AT_REST or order > 0:
        first, other = _monodromy(
            problem, state, max(order, 1), max_events, log, points, growth, spare
        )
        if class_ == AT_REST or (order == 1 and _rests(problem, spare, 1)):
            # Every angle that the brake holds is an equilibrium; deviations of speed die at once.
            return AT_REST, 0, returned, 0.0, 0.0, -math.inf
        if attracts(first, returned, window, ruler, size):
            return class_, order, returned, first / order, 0.0, other / order
        class_, order = UNDECIDED, 0
    return class_, order, returned, mean, error, second


@compiled
def _settle(problem, state, limit, max_events, log, points, growth, tally, spare):
    """Windows, each as long as all before it, until the motion has settled in one.

    Returns (outcome, state, events, verdict, judged periods, settling).
    """
    verdict = (UNDECIDED, 0, math.nan, math.nan, math.nan, math.nan)
    events, judged, settling = 0, 0, math.nan
    outcome = COMPLETED
    while state[0] < limit:
        begin = state[0]
        count.clear(tally)
        outcome, state, more, _, logdet, ranked, _ = _advance(
            problem, state, next_window(begin, limit), max_events - events, log, points, tally,
            _fresh(_weight(problem)), growth, begin,
        )  # fmt: skip
        events += more
        if outcome != COMPLETED:
            break
        verdict = _window_verdict(
            problem, state, begin, max_events, log, points, growth, tally, spare, logdet, ranked
        )
        judged, settling = state[0] - begin, float(begin)
        if verdict[0] == AT_REST:
            settling = max(0.0, math.ceil(tally[count.LAST_SLIP]))
            break
        if verdict[1] > 0:
            ruler = _ruler(problem)
            settling = float(settling_of(points, verdict[1], state[0], ruler, _size(tally, ruler)))
            break
    return outcome, state, events, verdict, judged, settling


@compiled
def _report(problem, verdict, tally, orbit, periods, answer):
    """Class, exponents and what adds up, into the answer.

    tally, orbit : of the record and, for a motion that repeats, of one orbit
    """
    length = 2.0 * math.pi / problem[4]
    class_, order, returned, first, error, second = verdict
    sums, counted = tally, periods
    if order > 0 or class_ == AT_REST:
        # One whole orbit, where the record may hold a broken number of them, or its end.
        sums, counted = orbit, max(order, 1)
    answer[CLASS], answer[ORDER], answer[RETURN_DISTANCE] = class_, order, returned
    answer[STICK_CLASS] = _stick_class(sums, class_ == AT_REST)
    answer[STICKS_FORWARD] = sums[count.STICKS_FORWARD] / counted
    answer[STICKS_BACKWARD] = sums[count.STICKS_BACKWARD] / counted
    answer[STICK_SHARE] = min(1.0, sums[count.REST_TIME] / (counted * length))
    answer[LARGEST_EXPONENT] = first / length
    answer[SECOND_EXPONENT] = second / length
    answer[EXPONENT_ERROR] = error / length if error < math.inf else math.nan
    answer[SIZE] = _size(tally, _ruler(problem))
    answer[PEAK_TORQUE] = sums[count.PEAK]
    answer[FRICTION_POWER] = sums[count.HEAT] / (counted * length)


@compiled
def judge(
    problem, theta, w, transient, periods, limit, max_events, log, points, growth, tallies, answer
):
    """Run one system, and judge it.

    problem   : the first thirteen arguments of ``exact.run``
    theta, w  : state at t = 0
    transient : periods before the record; negative: as many as it takes to settle, at most
                ``limit``
    periods   : recorded periods
    log       : (rows, LOG_COLUMNS), at least two rows
    points    : (transient or limit + periods + LONGEST + 1, 2), receives the Poincare points
    growth    : (as many,) room
    tallies   : (2, tally.ENTRIES) room
    answer    : (COLUMNS,) the result

    Returns (begin, end): points[begin:end] is the record.
    """
    tally, spare = tallies[0], tallies[1]
    for column in range(COLUMNS):
        answer[column] = math.nan
    points[0, 0], points[0, 1] = theta, w
    # A plain 0 would be a type of its own, and all that it reaches be compiled once more.
    state = (np.int64(0), 0.0, theta, w)
    verdict = (UNDECIDED, 0, math.nan, math.nan, math.nan, math.nan)
    judged, settling = 0, math.nan
    if transient >= 0:
        outcome, period, t, theta, w, events, _, _ = run(
            *problem, *state, transient, 0.0, max_events, log[:0], points[1 : transient + 1]
        )
        state = (period, t, theta, w)
    else:
        outcome, state, events, verdict, judged, settling = _settle(
            problem, state, limit, max_events, log, points, growth, tally, spare
        )

    begin = state[0]
    logdet, ranked = 0.0, True
    if outcome == COMPLETED:
        count.clear(tally)
        outcome, state, more, _, logdet, ranked, _ = _advance(
            problem, state, begin + periods, max_events - events, log, points, tally,
            _fresh(_weight(problem)), growth, begin,
        )  # fmt: skip
        events += more
    answer[OUTCOME], answer[EVENTS] = outcome, events
    answer[FINAL_THETA], answer[FINAL_W] = state[2], state[3]
    answer[TRANSIENT], answer[JUDGED] = begin, judged
    answer[SLIDING_DAMPING] = _sliding_damping(problem)
    if outcome != COMPLETED:
        answer[CLASS], answer[ORDER] = UNDECIDED, 0.0
        if outcome == DIVERGED:
            answer[CLASS] = RUNAWAY
        elif outcome == NO_SLIDING:
            answer[CLASS] = LOCKED
        return begin, state[0] + 1 if state[0] > begin else begin

    if transient >= 0:
        answer[JUDGED] = periods
        verdict = _window_verdict(
            problem, state, begin, max_events, log, points, growth, tally, spare, logdet, ranked
        )
    elif verdict[0] == AT_REST or verdict[1] > 0:
        # Of the orbit, or the rest, as it is in the end.
        order = max(verdict[1], 1)
        first, second = _monodromy(problem, state, order, max_events, log, points, growth, spare)
        if verdict[1] > 0:
            verdict = (verdict[0], order, verdict[2], first / order, 0.0, second / order)
    _report(problem, verdict, tally, spare, periods, answer)
    answer[SETTLING] = settling
    return begin, begin + periods + 1
