"""Verdict on a snapshot, as a sentence and as tiles."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import DirectionStability
from wedgebrake.analysis.motion import Motion
from wedgebrake.analysis.sticking import AT_REST, BIDIRECTIONAL, NON_STICK_SLIP
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.explorer.core.formatting import counted, duration, plain, signed
from wedgebrake.explorer.core.snapshot import LIMITS, Snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.figures.data.caption import capitalized
from wedgebrake.figures.matplotlib.style import percent
from wedgebrake.model.friction import SmoothFriction

Tile = tuple[str, str, str, str]
"""Value, detail, hint and tone."""

_PARTS = ("value", "detail", "hint", "tone")
# In ascending severity; the headline has the most severe tone of its tiles.
_TONES = ("neutral", "good", "warn", "bad")
_WAYS = {1: "forwards", -1: "backwards"}
# Disturbances whose multiplier is this close to 1 count as neither decaying nor growing.
_SLOW = 1e-9
# Without a torque: fewest samples, velocity that counts as steady relative to the largest,
# and the smallest relative change between two halves that is reported.
_SEEN, _STEADY, _CHANGE = 16, 1e-6, 2e-3
# Fewest vibrations whose change is shown, and the share of time that counts as all of it.
_FEW, _ALL = 8.0, 1.0 - 1e-9
_STUCK = (
    "The brake sticks to the shaft all the time and is carried along; the spring winds up until its"
    " torque breaks the brake loose."
)
_UNKNOWN = ("–", "not known", "There is no settled motion to evaluate.", "neutral")
# A mean torque below this share of the peak is zero.
_ROUNDING = 1e-9


def verdict(state: PageState, snapshot: Snapshot) -> dict[str, Any]:
    """The verdict on a system, as plain values for JSON.

    Returns {headline, tone, tiles}; a tile is {name, title, value, detail, hint, tone}, in
    order forward, backward, locking, motion, sticks, torque, share. A tone is "good", "warn"
    (unstable but bounded, sub-harmonic, quasi-periodic, locked at rest, undecided), "bad"
    (diverged, locked in motion, chaotic) or "neutral".
    """
    tiles = {
        "forward": ("Sliding forwards", _direction(state, snapshot, snapshot.stability.forward)),
        "backward": ("Sliding backwards", _direction(state, snapshot, snapshot.stability.backward)),
        "locking": ("Self-locking", _LOCKING[snapshot.stability.self_locking][0]),
        "motion": ("Motion", _motion(state, snapshot)),
        "sticks": ("Stick-slip", _sticks(state, snapshot.motion)),
        "torque": ("Brake torque", _torque(snapshot)),
        "share": ("Time stuck", _share(state, snapshot.motion)),
    }
    tone = max((tile[3] for _, tile in tiles.values()), key=_TONES.index)
    sentences = [
        _LOCKING[snapshot.stability.self_locking][1],
        _stability_sentence(state, snapshot),
        _motion_sentence(state, snapshot),
        _settling_sentence(state, snapshot),
    ]
    return {
        "headline": " ".join(one for one in sentences if one),
        "tone": "good" if tone == "neutral" else tone,
        "tiles": [
            {"name": name, "title": title, **dict(zip(_PARTS, tile, strict=True))}
            for name, (title, tile) in tiles.items()
        ],
    }


def _direction(state: PageState, snapshot: Snapshot, one: DirectionStability) -> Tile:
    """Linear stability of sliding in one direction, with its margin."""
    way = _WAYS[one.direction]
    turns = state.system.driveline.drive_speed != 0.0
    if one.speed is None:
        hint = f"The shaft turns in the other direction, so that there is no steady sliding {way}."
        return ("does not exist", "opposite to the shaft", hint, "neutral")
    where = f" at the shaft speed of {plain(one.speed)} rad/s" if turns else ""
    if one.locked:
        hint = f"The brake locks itself {way}{where}: steady sliding does not exist."
        detail = "the brake locks at Ω" if turns else "the brake locks"
        return ("does not exist", detail, hint, "neutral")
    word = _stability_word(one)
    damping = one.damping or 0.0
    if turns:
        detail = f"{signed(damping)} N m s/rad at Ω"
    elif one.margin_eta is not None:
        detail = f"margin {signed(one.margin_eta)} in η"
    elif one.margin_slope is not None:
        detail = f"margin {signed(one.margin_slope)} N s/rad"
    else:
        detail = "no friction, any slope"
    how = "oscillating" if one.oscillates else "without oscillation"
    does = {"stable": "decays", "unstable": "grows"}.get(word, "neither decays nor grows")
    hint = (
        f"Small vibration about steady sliding {way}{where} {does}, {how}: its damping is"
        f" {plain(damping)} N m s/rad."
    )
    if one.released:
        hint += " The actuator is released at this speed, so that only the driveline damps."
    elif one.hopf_slope is not None:
        eta = "" if one.hopf_eta is None else f", η = {plain(one.hopf_eta)}"
        hint += (
            f" Its damping vanishes where the slope of the actuation force is"
            f" {plain(one.hopf_slope)} N s/rad{eta}; the margin is the distance from there."
        )
    if word == "unstable":
        return (word, detail, hint + _bound(state, snapshot), "warn")
    return (word, detail, hint, "good" if word == "stable" else "neutral")


def _stability_word(one: DirectionStability) -> str:
    """Stable, unstable or neutral; the latter without damping, or without a spring."""
    if one.stable:
        return "stable"
    return "unstable" if one.damping is not None and one.damping < 0.0 else "neutral"


def _bound(state: PageState, snapshot: Snapshot) -> str:
    if snapshot.motion.kind == "diverged":
        return " Nothing bounds the vibration."
    speed = state.system.actuation.release_speed
    if math.isfinite(speed):
        return (
            f" Beyond {plain(speed)} rad/s the actuation force would be negative; there the brake"
            " releases and adds no more energy."
        )
    return " The brake does not release: a larger disturbance may grow without bound."


# By kind of self-locking: its tile, and the sentence of the headline.
_LOCKING: dict[str, tuple[Tile, str]] = {
    "kinetic": ((
        "in motion", "cannot slide forwards",
        "No forward sliding exists, and no torque breaks the brake loose forwards.", "bad",
    ), "Locks itself: cannot slide forwards."),
    "static": ((
        "at rest", "no breaking loose",
        "Static friction locks the brake at rest: once moving it can slide forwards.", "warn",
    ), "Locks itself at rest."),
    "none": ((
        "none", "slides both ways",
        "A torque that is large enough turns the shaft in both directions.", "good",
    ), ""),
}  # fmt: skip


def _motion(state: PageState, snapshot: Snapshot) -> Tile:
    motion = snapshot.motion
    if _stuck(state, motion):
        return ("stuck", "turns with the shaft", _STUCK, "bad")
    alone = _undriven(state, snapshot)
    if alone is not None:
        hint = (
            "No torque drives the system, and its motion has no class; this describes the last"
            " periods."
        )
        value, detail, _, tone = alone
        return (value, detail, hint, tone)
    about = MotionClass.named(motion.kind).about
    tone, hint = about.tone, about.meaning
    rate = motion.largest_exponent
    if motion.order and -math.inf < rate < -_SLOW:
        hint += f" A small disturbance shrinks e-fold in {duration(-1.0 / rate)}."
    if motion.kind != "at rest":
        hint += " " + capitalized(re.sub(r"(?<!\w)-(?=\d)", "−", motion.verdict))
    if snapshot.status != "completed":
        hint += f" {snapshot.message}"
    elif motion.kind == "undecided":
        hint += f" {_help(state, motion)}"
    return (motion.word, _evidence(snapshot), hint.strip(), tone)


def _undriven(state: PageState, snapshot: Snapshot) -> tuple[str, str, str, str] | None:
    """A motion without a torque that has no class: its name, a detail, a beginning, a tone.

    None for all others. With smooth friction such motions are classified by the period of the
    torque, which has no meaning for them.
    """
    line, motion, velocity = state.system.driveline, snapshot.motion, snapshot.settled
    if state.system.excitation.amplitude > 0.0 or snapshot.status != "completed":
        return None
    # A vibration that neither grows nor decays repeats too, but attracts no other motion.
    attracts = motion.kind != "limit cycle" or motion.second_exponent < -_SLOW
    known = motion.kind == "at rest" or (motion.self_excited and motion.settled and attracts)
    if known or velocity.size < _SEEN or _stuck(state, motion):
        return None
    early, late = (float(np.ptp(half)) for half in np.array_split(velocity, 2))
    if late <= _STEADY * max(abs(line.drive_speed), float(np.abs(velocity).max())):
        if line.drive_speed != 0.0:
            return "steady", "slides evenly", "Slides evenly with the shaft", "good"
        return "steady", "no vibration", "Does not vibrate", "good"
    cycles = _cycles(velocity)
    hertz = change = ""
    spectrum = snapshot.figures.spectrum
    if cycles >= _FEW and spectrum.amplitude.size > 1 and spectrum.natural > 0.0:
        place = int(np.argmax(spectrum.amplitude[1:])) + 1
        hertz = f" at {spectrum.frequency[place]:.3g} Hz"
        if abs(late - early) > _CHANGE * early:
            change = "growing" if late > early else "shrinking"
        else:
            change = "lasts"
    said = ", ".join(one for one in (hertz.strip(), change) if one)
    sticks = motion.stick_class != NON_STICK_SLIP
    fed = line.drive_speed != 0.0 and snapshot.stability.damping < 0.0
    if sticks or fed or change == "growing":
        return "self-excited", said, f"Vibrates by itself{hertz}, without a torque", "warn"
    if change == "shrinking":
        return "fading", hertz.strip(), f"Its free vibration{hertz} fades", "good"
    return "free vibration", said, f"Vibrates freely{hertz}, without a torque", "neutral"


def _cycles(velocity: NDArray[np.float64]) -> float:
    """Number of oscillations of a velocity."""
    signs = np.sign(velocity - 0.5 * (velocity.max() + velocity.min()))
    return 0.5 * float(np.count_nonzero(np.diff(signs[signs != 0.0])))


def _stuck(state: PageState, motion: Motion) -> bool:
    """Return True if the brake sticks to a turning shaft permanently."""
    return state.system.driveline.drive_speed != 0.0 and motion.stick_share >= _ALL


def _evidence(snapshot: Snapshot) -> str:
    motion, rate = snapshot.motion, snapshot.motion.largest_exponent
    if snapshot.status in LIMITS:
        return "the run met a limit of work"
    if detail := MotionClass.named(motion.kind).about.detail:
        return detail
    if motion.kind == "limit cycle":
        return _frequency(motion)
    if motion.kind == "chaotic":
        return (
            f"errors double in {duration(math.log(2.0) / rate)}" if rate > 0.0 else "unpredictable"
        )
    if math.isnan(rate):
        return "" if motion.order else "too few periods"
    if rate == -math.inf:
        return "recovers at once"
    if rate < -_SLOW:
        return f"recovers in {duration(-1.0 / rate)}" if motion.order else "still settling"
    return "disturbances persist" if motion.order else "too few periods"


def _frequency(motion: Motion) -> str:
    return f"at {1.0 / motion.period:.3g} Hz"


def _help(state: PageState, motion: Motion) -> str:
    rate = motion.largest_exponent
    if rate < -_SLOW and math.isfinite(rate):
        periods = -math.log(1e-5) / -rate * state.system.excitation.frequency
        help_ = f"It settles slowly, within about {plain(periods)} periods of the torque"
        return f"{help_}: run more of them, or add damping."
    if isinstance(state.system.friction, SmoothFriction):
        return "Run more periods, or take Coulomb friction, which is solved exactly."
    return "Run more periods of the torque."


def _sticks(state: PageState, motion: Motion) -> Tile:
    kind = motion.stick_class
    if _stuck(state, motion):
        return ("always stuck", "with the shaft", _STUCK, "neutral")
    if kind == AT_REST:
        return ("always stuck", "no sliding at all", "There is no sliding.", "neutral")
    if kind == NON_STICK_SLIP:
        hint = "The brake slides all the time; it never comes to rest relative to the drum."
        return ("never sticks", "slides all the time", hint, "good")
    count = motion.sticks_forward + motion.sticks_backward
    if not math.isfinite(count):
        return _UNKNOWN
    hint = (
        f"Sticks in a period of the torque: {plain(motion.sticks_forward)} entered from forward"
        f" and {plain(motion.sticks_backward)} from backward sliding."
    )
    if kind == BIDIRECTIONAL:
        value = "both ways"
    else:
        value = "from forward" if motion.sticks_forward > 0.0 else "from backward"
    often = f"{plain(count, 3)} {'stick' if count == 1.0 else 'sticks'} a period"
    return (value, often, hint, "neutral")


def _torque(snapshot: Snapshot) -> Tile:
    """Mean and peak of the brake torque, beside those of the conventional brake."""
    one = snapshot.braking
    if not (math.isfinite(one.mean_size) and math.isfinite(one.peak)):
        return _UNKNOWN
    detail = f"peak {plain(one.peak, 3)}"
    mean = one.mean if abs(one.mean) > _ROUNDING * one.peak else 0.0
    hint = (
        f"Mean size of the brake torque R Fμ, sticks included; its signed mean is"
        f" {plain(mean)} N m, its largest size {plain(one.peak)} N m."
    )
    if snapshot.comparison is not None and math.isfinite(snapshot.comparison.braking.mean_size):
        other = snapshot.comparison.braking
        detail = f"conventional: {plain(other.mean_size, 3)} N m"
        hint += (
            f" The conventional brake with the same radius: mean {plain(other.mean_size)} N m,"
            f" largest {plain(other.peak)} N m."
        )
    return (f"{plain(one.mean_size, 3)} N m", detail, hint, "neutral")


def _share(state: PageState, motion: Motion) -> Tile:
    share = motion.stick_share
    if not math.isfinite(share):
        return _UNKNOWN
    turns = state.system.driveline.drive_speed != 0.0
    detail = "of the time, with the shaft" if turns else "of the time at rest"
    hint = "Share of the time in which the brake does not slide."
    return ("0 %" if share == 0.0 else percent(share), detail, hint, "neutral")


# The headline.


def _stability_sentence(state: PageState, snapshot: Snapshot) -> str:
    both = (snapshot.stability.forward, snapshot.stability.backward)
    if state.system.driveline.drive_speed != 0.0:
        one = next(one for one in both if one.speed is not None)
        if one.locked:
            known = snapshot.stability.self_locking == "kinetic"
            return "" if known else "At the shaft's speed the brake locks itself."
        return f"Sliding at the shaft's speed is linearly {_stability_word(one)}."
    words = {_WAYS[one.direction]: _stability_word(one) for one in both if not one.locked}
    for word in ("unstable", "neutral"):
        ways = [way for way, found in words.items() if found == word]
        if ways:
            where = "both ways" if len(ways) == len(both) else ways[0]
            return f"Linearly {word} {where}."
    if len(words) < len(both):
        return "".join(f"Linearly stable {way}." for way in words)
    return "Linearly stable."


def _motion_sentence(state: PageState, snapshot: Snapshot) -> str:
    motion = snapshot.motion
    if _stuck(state, motion):
        return "Stuck to the turning shaft throughout the run."
    alone = _undriven(state, snapshot)
    if alone is not None:
        return f"{alone[2]}{_sticks_clause(motion)}."
    sentence = MotionClass.named(motion.kind).about.headline
    over = motion.kind in ("at rest", "diverged", "self-locked")
    if snapshot.status in LIMITS and not over:
        return "The run met a limit of work and was stopped; run fewer periods of the torque."
    if sentence.endswith("."):
        return sentence
    if motion.kind == "limit cycle":
        sentence = sentence.replace(",", f" {_frequency(motion)},", 1)
    return f"{sentence.format(order=counted(motion.order))}{_sticks_clause(motion)}."


def _settling_sentence(state: PageState, snapshot: Snapshot) -> str:
    """A sentence if the verdict is on a later motion than the pictures show."""
    motion = snapshot.motion
    repeats = motion.order > 0 or motion.kind == "at rest"
    driven = state.system.excitation.amplitude > 0.0
    if not (driven and repeats) or not (
        math.isfinite(motion.settling) and motion.settling > state.periods
    ):
        return ""
    return f"So from period {motion.settling:.0f} on; the pictures show the first {state.periods}."


def _sticks_clause(motion: Motion) -> str:
    if motion.stick_class == NON_STICK_SLIP:
        return ", without sticking"
    if motion.stick_class == BIDIRECTIONAL:
        return ", sticks in both directions"
    if motion.stick_class == AT_REST or not math.isfinite(motion.sticks_forward):
        return ""
    return f", sticks from {'forward' if motion.sticks_forward > 0.0 else 'backward'} sliding only"
