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
from wedgebrake.explorer.core.formatting import counted, duration, plain, signed, upper
from wedgebrake.explorer.core.snapshot import Moment
from wedgebrake.explorer.core.state import Desk
from wedgebrake.figures.matplotlib.style import percent
from wedgebrake.model.friction import SmoothFriction

Tile = dict[str, str]

# From harmless to feared: what the headline takes of its tiles.
_TONES = ("neutral", "good", "warn", "bad")
_WAYS = {1: "forwards", -1: "backwards"}
# A multiplier so close to 1 neither fades nor grows, for an eye.
_SLOW = 1e-9
# Without a torque: samples to see a motion by, a velocity that is steady against the largest,
# and the change between two halves that is seen.
_SEEN, _STEADY, _CHANGE = 16, 1e-6, 2e-3
# Vibrations below which no change is told, and a share of time that is all of it.
_FEW, _ALL = 8.0, 1.0 - 1e-9
_STUCK = (
    "The brake sticks to the shaft all the time and is carried along; the spring winds up until its"
    " torque breaks the brake loose."
)
# A mean torque below this share of the peak is zero.
_ROUNDING = 1e-9
_LIMITS = ("event_limit", "step_limit")


def verdict(desk: Desk, moment: Moment) -> dict[str, Any]:
    """The verdict on what a machine does, plain for JSON.

    Returns {headline, tone, tiles}; a tile is {name, title, value, detail, hint, tone}, in
    order forward, backward, locking, motion, sticks, torque, share. A tone is "good", "warn"
    (unstable but bounded, sub-harmonic, quasi-periodic, locked at rest, undecided), "bad"
    (diverged, locked in motion, chaotic) or "neutral".
    """
    tiles = [
        _direction(desk, moment, moment.stability.forward),
        _direction(desk, moment, moment.stability.backward),
        _locking(moment),
        _motion(desk, moment),
        _sticks(desk, moment.motion),
        _torque(moment),
        _share(desk, moment.motion),
    ]
    tone = max((tile["tone"] for tile in tiles), key=_TONES.index)
    sentences = [
        _said_of_locking(moment),
        _said_of_stability(desk, moment),
        _said_of_motion(desk, moment),
        _said_of_settling(desk, moment),
    ]
    return {
        "headline": " ".join(one for one in sentences if one),
        "tone": "good" if tone == "neutral" else tone,
        "tiles": tiles,
    }


def _tile(name: str, title: str, value: str, detail: str, hint: str, tone: str) -> Tile:
    return {
        "name": name, "title": title, "value": value, "detail": detail, "hint": hint,
        "tone": tone,
    }  # fmt: skip


def _direction(desk: Desk, moment: Moment, one: DirectionStability) -> Tile:
    """Linear stability of sliding in one direction, with its margin."""
    way = _WAYS[one.direction]
    name, title = way.removesuffix("s"), f"Sliding {way}"
    turns = desk.system.driveline.drive_speed != 0.0
    if one.speed is None:
        hint = f"The shaft turns the other way, so that there is no steady sliding {way}."
        return _tile(name, title, "does not exist", "opposite to the shaft", hint, "neutral")
    where = f" at the shaft speed of {plain(one.speed)} rad/s" if turns else ""
    if one.locked:
        hint = f"The brake locks itself {way}{where}: steady sliding does not exist."
        detail = "the brake locks at Ω" if turns else "the brake locks"
        return _tile(name, title, "does not exist", detail, hint, "neutral")
    state = _state(one)
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
    does = {"stable": "decays", "unstable": "grows"}.get(state, "neither decays nor grows")
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
    if state == "unstable":
        return _tile(name, title, state, detail, hint + _bound(desk, moment), "warn")
    return _tile(name, title, state, detail, hint, "good" if state == "stable" else "neutral")


def _state(one: DirectionStability) -> str:
    """Stable, unstable or neutral; the latter without damping, or without a spring."""
    if one.stable:
        return "stable"
    return "unstable" if one.damping is not None and one.damping < 0.0 else "neutral"


def _bound(desk: Desk, moment: Moment) -> str:
    """Describe the limit of a growing vibration."""
    if moment.motion.kind == "diverged":
        return " Nothing bounds the vibration."
    speed = desk.system.actuation.release_speed
    if math.isfinite(speed):
        return (
            f" Beyond {plain(speed)} rad/s the actuation force would be negative; there the brake"
            " releases and adds no more energy."
        )
    return " The brake does not release: a larger disturbance may grow without bound."


def _locking(moment: Moment) -> Tile:
    kind = moment.stability.self_locking
    title = "Self-locking"
    if kind == "kinetic":
        hint = "No forward sliding exists, and no torque breaks the brake loose forwards."
        return _tile("locking", title, "in motion", "cannot slide forwards", hint, "bad")
    if kind == "static":
        hint = (
            "At rest no torque breaks the brake loose forwards: static friction locks it. Once"
            " moving it can slide forwards."
        )
        return _tile("locking", title, "at rest", "no breaking loose", hint, "warn")
    hint = "A torque that is large enough turns the shaft in both directions."
    return _tile("locking", title, "none", "slides both ways", hint, "good")


_CLASSES = {
    "synchronous": ("good", "The motion repeats in every period of the torque."),
    "periodic": ("warn", "The motion repeats after several periods of the torque."),
    "quasi-periodic": (
        "warn", "The motion is made of two frequencies without a common period."
    ),
    "chaotic": (
        "bad", "Small differences grow, so that no prediction reaches far; the motion is bounded."
    ),
    "at rest": ("good", "The brake holds: nothing moves relative to it."),
    "diverged": ("bad", ""),
    "self-locked": ("bad", ""),
    "undecided": ("warn", ""),
}  # fmt: skip


def _motion(desk: Desk, moment: Moment) -> Tile:
    """The class of the motion, with the evidence."""
    motion = moment.motion
    if _stuck(desk, motion):
        return _tile("motion", "Motion", "stuck", "turns with the shaft", _STUCK, "bad")
    alone = _undriven(desk, moment)
    if alone is not None:
        hint = (
            "No torque drives the machine, so that classes by the torque's period say nothing;"
            " what is told is seen of the last periods."
        )
        value, detail, _, tone = alone
        return _tile("motion", "Motion", value, detail, hint, tone)
    tone, meaning = _CLASSES.get(motion.kind, ("neutral", ""))
    hint = meaning
    rate = motion.largest_exponent
    if motion.order and -math.inf < rate < -_SLOW:
        hint += f" A small disturbance shrinks e-fold in {duration(-1.0 / rate)}."
    if motion.kind != "at rest":
        hint += " " + upper(re.sub(r"(?<!\w)-(?=\d)", "−", motion.verdict))
    if moment.status != "completed":
        hint += f" {moment.message}"
    elif motion.kind == "undecided":
        hint += f" {_help(desk, motion)}"
    return _tile("motion", "Motion", motion.word, _evidence(moment), hint.strip(), tone)


def _undriven(desk: Desk, moment: Moment) -> tuple[str, str, str, str] | None:
    """Without a torque: the motion, a detail, a sentence's beginning, a tone; else None."""
    line = desk.system.driveline
    if desk.system.excitation.amplitude > 0.0 or moment.status != "completed":
        return None
    velocity = moment.settled
    if moment.motion.kind == "at rest" or velocity.size < _SEEN or _stuck(desk, moment.motion):
        return None
    early, late = (float(np.ptp(half)) for half in np.array_split(velocity, 2))
    if late <= _STEADY * max(abs(line.drive_speed), float(np.abs(velocity).max())):
        if line.drive_speed != 0.0:
            return "steady", "slides evenly", "Slides evenly with the shaft", "good"
        return "steady", "no vibration", "Does not vibrate", "good"
    cycles = _cycles(velocity)
    hertz, change = "", ""
    spectrum = moment.figures.spectrum
    if cycles >= _FEW and spectrum.amplitude.size > 1 and spectrum.natural > 0.0:
        place = int(np.argmax(spectrum.amplitude[1:])) + 1
        hertz = f" at {spectrum.frequency[place]:.3g} Hz"
        if abs(late - early) > _CHANGE * early:
            change = "growing" if late > early else "shrinking"
        else:
            change = "lasts"
    said = ", ".join(one for one in (hertz.strip(), change) if one)
    sticks = moment.motion.stick_class != NON_STICK_SLIP
    fed = line.drive_speed != 0.0 and moment.stability.damping < 0.0
    if sticks or fed or change == "growing":
        return "self-excited", said, f"Vibrates by itself{hertz}, without a torque", "warn"
    if change == "shrinking":
        return "fading", hertz.strip(), f"Its free vibration{hertz} fades", "good"
    return "free vibration", said, f"Vibrates freely{hertz}, without a torque", "neutral"


def _cycles(velocity: NDArray[np.float64]) -> float:
    """How often a velocity goes to and fro."""
    signs = np.sign(velocity - 0.5 * (velocity.max() + velocity.min()))
    return 0.5 * float(np.count_nonzero(np.diff(signs[signs != 0.0])))


def _stuck(desk: Desk, motion: Motion) -> bool:
    """Return True if the brake sticks to a turning shaft permanently."""
    return desk.system.driveline.drive_speed != 0.0 and motion.stick_share >= _ALL


def _evidence(moment: Moment) -> str:
    motion, rate = moment.motion, moment.motion.largest_exponent
    if moment.status in _LIMITS:
        return "the run met a limit of work"
    words = {
        "quasi-periodic": "never quite repeats",
        "at rest": "the brake holds",
        "diverged": "grows without bound",
        "self-locked": "no longer slides",
    }
    if motion.kind in words:
        return words[motion.kind]
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
    return "disturbances stay" if motion.order else "too few periods"


def _help(desk: Desk, motion: Motion) -> str:
    """Suggest remedies for an undecided class."""
    rate = motion.largest_exponent
    if rate < -_SLOW and math.isfinite(rate):
        periods = -math.log(1e-5) / -rate * desk.system.excitation.frequency
        help_ = f"It settles slowly, within about {plain(periods)} periods of the torque"
        return f"{help_}: run more of them, or add damping."
    if isinstance(desk.system.friction, SmoothFriction):
        return "Run more periods, or take Coulomb friction, which is solved exactly."
    return "Run more periods of the torque."


def _sticks(desk: Desk, motion: Motion) -> Tile:
    """The class of stick-slip."""
    title, kind = "Stick-slip", motion.stick_class
    if _stuck(desk, motion):
        return _tile("sticks", title, "always stuck", "with the shaft", _STUCK, "neutral")
    if kind == AT_REST:
        hint = "There is no sliding at all."
        return _tile("sticks", title, "always stuck", "no sliding at all", hint, "neutral")
    if kind == NON_STICK_SLIP:
        hint = "The brake slides all the time; it never comes to rest relative to the drum."
        return _tile("sticks", title, "never sticks", "slides all the time", hint, "good")
    count = motion.sticks_forward + motion.sticks_backward
    if not math.isfinite(count):
        return _tile("sticks", title, "–", "not known", "The run has no settled part.", "neutral")
    hint = (
        f"Sticks in a period of the torque: {plain(motion.sticks_forward)} entered from forward"
        f" and {plain(motion.sticks_backward)} from backward sliding."
    )
    if kind == BIDIRECTIONAL:
        value = "both ways"
    else:
        value = "from forward" if motion.sticks_forward > 0.0 else "from backward"
    often = f"{plain(count, 3)} {'stick' if count == 1.0 else 'sticks'} a period"
    return _tile("sticks", title, value, often, hint, "neutral")


def _torque(moment: Moment) -> Tile:
    """Mean and peak of the brake torque, beside those of the conventional brake."""
    title, one = "Brake torque", moment.braking
    if not (math.isfinite(one.mean_size) and math.isfinite(one.peak)):
        hint = "There is no settled motion to take it from."
        return _tile("torque", title, "–", "not known", hint, "neutral")
    detail = f"peak {plain(one.peak, 3)}"
    mean = one.mean if abs(one.mean) > _ROUNDING * one.peak else 0.0
    hint = (
        f"Mean size of the brake torque R Fμ, sticks included; its signed mean is"
        f" {plain(mean)} N m, its largest size {plain(one.peak)} N m."
    )
    if moment.ghost is not None and math.isfinite(moment.ghost.braking.mean_size):
        other = moment.ghost.braking
        detail = f"conventional: {plain(other.mean_size, 3)} N m"
        hint += (
            f" The conventional brake with the same radius: mean {plain(other.mean_size)} N m,"
            f" largest {plain(other.peak)} N m."
        )
    return _tile("torque", title, f"{plain(one.mean_size, 3)} N m", detail, hint, "neutral")


def _share(desk: Desk, motion: Motion) -> Tile:
    title, share = "Time stuck", motion.stick_share
    if not math.isfinite(share):
        hint = "There is no settled motion to take it from."
        return _tile("share", title, "–", "not known", hint, "neutral")
    turns = desk.system.driveline.drive_speed != 0.0
    detail = "of the time, with the shaft" if turns else "of the time at rest"
    hint = "Share of the time in which the brake does not slide."
    return _tile("share", title, "0 %" if share == 0.0 else percent(share), detail, hint, "neutral")


# The headline.

_ENDS = {
    "at rest": "Stays at rest: the brake holds.",
    "diverged": "Grows without bound: let the brake release, or make the slope less negative.",
    "self-locked": "Locks itself: lower the friction, or change the brake.",
}


def _said_of_locking(moment: Moment) -> str:
    return {
        "kinetic": "Locks itself: cannot slide forwards.",
        "static": "Locks itself at rest.",
    }.get(moment.stability.self_locking, "")


def _said_of_stability(desk: Desk, moment: Moment) -> str:
    both = (moment.stability.forward, moment.stability.backward)
    if desk.system.driveline.drive_speed != 0.0:
        one = next(one for one in both if one.speed is not None)
        if one.locked:
            known = moment.stability.self_locking == "kinetic"
            return "" if known else "At the shaft's speed the brake locks itself."
        return f"Sliding at the shaft's speed is linearly {_state(one)}."
    states = {_WAYS[one.direction]: _state(one) for one in both if not one.locked}
    for state in ("unstable", "neutral"):
        ways = [way for way, found in states.items() if found == state]
        if ways:
            where = "both ways" if len(ways) == len(both) else ways[0]
            return f"Linearly {state} {where}."
    if len(states) < len(both):
        return "".join(f"Linearly stable {way}." for way in states)
    return "Linearly stable."


def _said_of_motion(desk: Desk, moment: Moment) -> str:
    motion = moment.motion
    if _stuck(desk, motion):
        return "Stuck to the turning shaft throughout the run."
    alone = _undriven(desk, moment)
    if alone is not None:
        return f"{alone[2]}{_said_of_sticks(motion)}."
    if motion.kind in _ENDS:
        return _ENDS[motion.kind]
    if moment.status in _LIMITS:
        return "The run met a limit of work and was stopped; run fewer periods of the torque."
    if motion.kind == "undecided":
        return "The motion has not settled yet, or the run is too short to tell."
    moves = {
        "synchronous": "Moves in step with the torque",
        "quasi-periodic": "Moves quasi-periodically, never quite repeating",
        "chaotic": "Moves chaotically",
        "periodic": f"Repeats every {counted(motion.order)} periods of the torque",
    }
    return f"{moves.get(motion.kind, upper(motion.word))}{_said_of_sticks(motion)}."


def _said_of_settling(desk: Desk, moment: Moment) -> str:
    """A word where the verdict is on a later motion than the pictures show."""
    motion = moment.motion
    repeats = motion.order > 0 or motion.kind == "at rest"
    driven = desk.system.excitation.amplitude > 0.0
    if not (driven and repeats) or not (
        math.isfinite(motion.settling) and motion.settling > desk.periods
    ):
        return ""
    return f"So from period {motion.settling:.0f} on; the pictures show the first {desk.periods}."


def _said_of_sticks(motion: Motion) -> str:
    if motion.stick_class == NON_STICK_SLIP:
        return ", without sticking"
    if motion.stick_class == BIDIRECTIONAL:
        return ", sticks in both directions"
    if motion.stick_class == AT_REST or not math.isfinite(motion.sticks_forward):
        return ""
    return f", sticks from {'forward' if motion.sticks_forward > 0.0 else 'backward'} sliding only"
