"""Verdict on a snapshot, as a sentence and as tiles, from the results of the analysis."""

from __future__ import annotations

import math
from functools import singledispatch
from typing import Any, NamedTuple

from wedgebrake.analysis.linear_stability import (
    DirectionStability,
    DrivelineStability,
    Stability,
    unpressed_sentences,
)
from wedgebrake.analysis.motion import Motion
from wedgebrake.analysis.responses.sticking import AT_REST, BIDIRECTIONAL, NON_STICK_SLIP
from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.explorer.core.class_texts import ClassText, text_of
from wedgebrake.explorer.core.snapshot import LIMITS, Snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.figures.data.caption import capitalized
from wedgebrake.figures.style import minus_signs, number, percent, signed
from wedgebrake.model.display import duration
from wedgebrake.model.system import BrakedDriveline


class Tile(NamedTuple):
    """One fact: its value, a detail, an explanation and a tone."""

    value: str
    detail: str
    hint: str
    tone: str = "neutral"


# In ascending severity; the headline has the most severe tone of its tiles.
_TONES = ("neutral", "good", "warn", "bad")
_STABILITY = {"decays": "stable", "grows": "unstable", "does not decay": "neutral"}
# Disturbances whose multiplier is this close to 1 count as neither decaying nor growing.
_SLOW = 1e-9
# The share of time that counts as all of it, and of the peak below which a mean torque is zero.
_ALL, _ROUNDING = 1.0 - 1e-9, 1e-9
STICK_SLIP = (
    "Stick-slip: friction holds the brake at rest (stick) until the other torques exceed what it"
    " can hold, then the brake slides (slip) until it comes to rest again."
)
"""What stick-slip is."""
_UNKNOWN = Tile("–", "not known", "There is no settled motion to evaluate.")
# By kind of self-locking: its tile, and the sentence of the headline.
_LOCKING = {
    "kinetic": (Tile(
        "in motion", "cannot slide forwards",
        "No forward sliding exists, and no torque breaks the brake loose forwards.", "bad",
    ), "Locks itself: cannot slide forwards."),
    "static": (Tile(
        "at rest", "no breaking loose",
        "Static friction locks the brake at rest: once moving it can slide forwards.", "warn",
    ), "Locks itself at rest."),
    "none": (Tile(
        "none", "slides both ways",
        "A torque that is large enough turns the shaft in both directions.", "good",
    ), ""),
}  # fmt: skip
# Motions that the classes do not distinguish.
_STUCK = ClassText(
    "stuck", tone="bad", detail="turns with the shaft",
    meaning="The brake sticks to the shaft all the time and is carried along; the spring winds up"
    " until its torque breaks the brake loose.",
    headline="Stuck to the turning shaft throughout the run.",
)  # fmt: skip
_UNCLASSED = ClassText(
    "not classified", tone="neutral", detail="no torque acts",
    meaning="With this method and brake, only motions under a periodic torque are classified.",
    headline="Moves without a torque",
)  # fmt: skip

_TRANSIENT = ClassText(
    "transient", tone="neutral", detail="signals do not repeat",
    meaning="The signals do not repeat: the motion is that of this run, and has no class.",
    headline="The signals do not repeat: the motion is that of this run.",
)  # fmt: skip
_SETTLING = ClassText(
    "…", tone="neutral", detail="being classified", meaning="The run is being continued.",
    headline="The motion is being classified.",
)  # fmt: skip


def verdict(state: PageState, snapshot: Snapshot) -> dict[str, Any]:
    """The verdict on a system, as plain values for JSON.

    Returns {headline, tone, tiles}; a tile is {name, title, value, detail, hint, tone}: of linear
    stability, for a driveline in order forward, backward, locking, then motion, sticks, torque,
    share. A tone is "good", "warn" (unstable but bounded, sub-harmonic, quasi-periodic, locked at
    rest, undecided), "bad" (diverged, locked in motion, chaotic) or "neutral".
    """
    motion, about = snapshot.motion, _about(state.system, snapshot)
    linear, locks, stable = _linear(snapshot.stability, state)
    tiles = {**linear, "motion": ("Motion", _motion(state, snapshot, about))}
    if state.system.machine.contacts:
        tiles |= {
            "sticks": ("Stick-slip", _UNKNOWN if motion is None else _sticks(motion, about)),
            "torque": (_of(state.contact, "Brake torque"), _torque(snapshot)),
            "share": ("Time stuck", _UNKNOWN if motion is None else _share(state.system, motion)),
        }
    refused = isinstance(snapshot.stability, str)
    tone = max((tile.tone for _, tile in tiles.values()), key=_TONES.index)
    sentences = [
        locks,
        stable,
        _motion_sentence(snapshot, about),
        "" if motion is None else _settling_sentence(state, motion),
    ]
    return {
        "headline": " ".join(filter(None, sentences)),
        "tone": "good" if tone == "neutral" and not refused else tone,
        "tiles": [
            {"name": name, "title": title, **tile._asdict()}
            for name, (title, tile) in tiles.items()
        ],
    }


def _of(part: str | None, words: str) -> str:
    """Words about a part, which is named where there are several."""
    return words if part is None else f"Torque of {part}"


Tiles = dict[str, tuple[str, Tile]]


@singledispatch
def _linear(found: Any, state: PageState) -> tuple[Tiles, str, str]:
    """Tiles of a linear verdict, a sentence on self-locking, and one on stability."""
    hint = f"There is no linear verdict on {state.system._headline()}: {found}"
    tiles = {"linear": ("Linear stability", Tile("–", "no linear verdict", hint))}
    return tiles, "", f"No linear verdict: {found}"


@_linear.register
def _(found: DrivelineStability, state: PageState) -> tuple[Tiles, str, str]:
    locking, locks = _LOCKING[found.self_locking]
    tiles = {
        "forward": ("Sliding forwards", _direction(state.system, found.forward)),
        "backward": ("Sliding backwards", _direction(state.system, found.backward)),
        "locking": ("Self-locking", locking),
    }
    return tiles, locks, _stability_sentence(found)


@_linear.register
def _(found: Stability, state: PageState) -> tuple[Tiles, str, str]:
    hint = " ".join([found.verdict, *unpressed_sentences(state.system, found)])
    locked = sorted({name for case in found.cases for name in case.locked})
    locking = (
        Tile(", ".join(locked), "cannot slide", f"Locks itself: {', '.join(locked)}.", "warn")
        if locked
        else Tile("none", "contacts can slide", "No contact locks itself.", "good")
    )
    if found.critical is None:
        tiles = {"linear": ("Steady sliding", Tile("does not exist", "contacts lock", hint))}
        return {**tiles, "locking": ("Self-locking", locking)}, "", ""
    mode = next((one for one in found.modes if not one.rigid), None)
    detail = "only free rotation"
    if mode is not None:
        detail = f"{signed(mode.growth_rate, 3)} 1/s at {number(mode.frequency, 3)} Hz"
    state_of = found.critical.state
    tone = {"decays": "good", "grows": "warn"}.get(state_of, "neutral")
    cases = f"{len(found.cases)} cases" if len(found.cases) > 1 else "1 case"
    feeds = None if mode is None else mode.fed_by
    contacts = state.system.machine.contacts
    title = "Steady sliding" if contacts else "Linear stability"
    tiles = {
        "linear": (title, Tile(_STABILITY[state_of], detail, hint, tone)),
        "mode": ("Critical mode", Tile(
            f"{number(100.0 * mode.damping_ratio, 3)} % damping" if mode is not None else "–",
            f"fed by {feeds}" if feeds else f"of {cases}",
            "Damping ratio of the mode that grows fastest or decays slowest, and the contact that"
            " feeds the most power into it.", tone,
        )),
    }  # fmt: skip
    tiles |= {"locking": ("Self-locking", locking)} if contacts else {}
    return tiles, "", f"Linearly {_STABILITY[state_of]}."


def _about(system: Any, snapshot: Snapshot) -> ClassText:
    motion = snapshot.motion
    if motion is None:
        return _TRANSIENT if system.machine.period is None else _SETTLING
    (turns, driven) = _base(system), motion.self_excited or not system.machine.autonomous
    if turns and motion.stick_share >= _ALL:
        return _STUCK
    about = text_of(MotionClass.named(motion.kind))
    return about if driven or not about.vibrates else _UNCLASSED


def _base(system: Any) -> bool:
    """True if a surface on which a brake slides moves."""
    return any(one.base_speed != 0.0 for one in system.machine.contacts)


def _direction(system: BrakedDriveline, one: DirectionStability) -> Tile:
    """Linear stability of sliding in one direction, with its margin."""
    if one.damping is None:
        detail = "opposite to the shaft" if one.speed is None else "the brake locks"
        return Tile("does not exist", detail, one._headline())
    if system.driveline.drive_speed != 0.0:
        detail = f"{signed(one.damping, 3)} N m s/rad at Ω"
    elif one.margin_eta is not None:
        detail = f"{signed(one.margin_eta, 3)} in η from Hopf"
    elif one.margin_slope is not None:
        detail = f"{signed(one.margin_slope, 3)} N s/rad from Hopf"
    else:
        detail = "no friction, any slope"
    hint = f"{one._headline()} Its damping is {number(one.damping)} N m s/rad."
    if one.released:
        hint += " The actuator is released at this speed, so that only the driveline damps."
    elif one.hopf_slope is not None:
        eta = "" if one.hopf_eta is None else f", η = {number(one.hopf_eta)}"
        slope = f"{number(one.hopf_slope)} N s/rad{eta}"
        hint += (
            f" The limit, a Hopf bifurcation, is a slope of the actuation force of {slope}:"
            " there vibration neither grows nor decays."
        )
    if one.state == "grows":
        release = system.actuation.release_speed
        hint += (
            f" The vibration is limited at the latest by the release at {number(release)} rad/s."
            if math.isfinite(release)
            else " The brake does not release: the vibration may grow without bound."
        )
    tone = {"decays": "good", "grows": "warn"}.get(one.state, "neutral")
    return Tile(_STABILITY[one.state], detail, hint, tone)


def _motion(state: PageState, snapshot: Snapshot, about: ClassText) -> Tile:
    motion = snapshot.motion
    hints = [about.meaning]
    if motion is None:
        detail = "ends at rest" if snapshot.at_rest else about.detail
        if snapshot.status != "completed":
            detail, hints = "ended early", [*hints, snapshot.message]
        return Tile(about.word, detail, " ".join(hints), about.tone)
    if motion.kind != "at rest":
        hints.append(capitalized(minus_signs(motion.verdict)))
    if snapshot.status != "completed":
        hints.append(snapshot.message)
    elif motion.kind == "undecided":
        hints.append(_advice(state, motion))
    value = motion.word if about.word == motion.kind else about.word
    return Tile(
        value, _evidence(snapshot, motion, about), " ".join(filter(None, hints)), about.tone
    )


def _evidence(snapshot: Snapshot, motion: Motion, about: ClassText) -> str:
    """The most important number about a motion, in a few words."""
    rate = motion.largest_exponent
    if snapshot.status in LIMITS:
        return "the run was stopped early"
    if about.detail:
        return about.detail
    if motion.self_excited and motion.order:
        return _frequency(motion)
    if motion.kind == "chaotic" and rate > 0.0:
        return f"errors double in {duration(math.log(2.0) / rate)}"
    if not motion.order:
        return "still settling" if -math.inf < rate < -_SLOW else "too few periods"
    if rate == -math.inf:
        return "recovers at once"
    return f"recovers in {duration(-1.0 / rate)}" if rate < -_SLOW else "disturbances persist"


def _frequency(motion: Motion) -> str:
    return f"at {1.0 / motion.period:.3g} Hz"


def _advice(state: PageState, motion: Motion) -> str:
    """How to let an undecided motion settle."""
    rate = motion.largest_exponent
    if not -math.inf < rate < -_SLOW:
        return "Run more periods."
    periods = math.log(1e5) / -rate / state.cycle
    return f"It settles within about {number(periods)} periods: run more of them, or add damping."


def _sticks(motion: Motion, about: ClassText) -> Tile:
    kind = motion.stick_class
    if about is _STUCK:
        return Tile("always stuck", "with the shaft", about.meaning)
    if kind == AT_REST:
        return Tile("always stuck", "no sliding at all", "There is no sliding.")
    if _partly_held(motion):
        hint = "Of the contacts, some stick and some slide; none changes between the two."
        return Tile("no stick-slip", "some contacts stick", f"{STICK_SLIP} {hint}", "good")
    if kind == NON_STICK_SLIP:
        hint = "The brake slides all the time; it never comes to rest relative to the drum."
        return Tile("never sticks", "slides all the time", f"{STICK_SLIP} {hint}", "good")
    forward, backward = motion.sticks_forward, motion.sticks_backward
    count = forward + backward
    if not math.isfinite(count):
        return _UNKNOWN
    hint = (
        f"{STICK_SLIP} Sticks in a period: {number(forward)} entered from forward and"
        f" {number(backward)} from backward sliding."
    )
    value = "both ways" if kind == BIDIRECTIONAL else f"from {_side(motion)}"
    often = f"{number(count, 3)} {'stick' if count == 1.0 else 'sticks'} a period"
    return Tile(value, often, hint)


def _partly_held(motion: Motion) -> bool:
    """Return True if a contact sticks all the time, as an engaged clutch, and none begins to."""
    return motion.stick_class == NON_STICK_SLIP and motion.stick_share >= _ALL


def _side(motion: Motion) -> str:
    """The direction of sliding before the sticks of a motion that sticks from one only."""
    return "forward" if motion.sticks_forward > 0.0 else "backward"


def _torque(snapshot: Snapshot) -> Tile:
    one = snapshot.braking
    if not (math.isfinite(one.mean_size) and math.isfinite(one.peak)):
        return _UNKNOWN
    detail = f"peak {number(one.peak, 3)}"
    mean = one.mean if abs(one.mean) > _ROUNDING * one.peak else 0.0
    hint = (
        f"Mean magnitude of the brake torque R Fμ, sticks included; its signed mean is"
        f" {number(mean)} N m, its largest magnitude {number(one.peak)} N m."
    )
    if snapshot.comparison is not None and math.isfinite(snapshot.comparison.braking.mean_size):
        other = snapshot.comparison.braking
        detail = f"conventional: {number(other.mean_size, 3)} N m"
        hint += (
            f" The conventional brake with the same radius: mean {number(other.mean_size)} N m,"
            f" largest {number(other.peak)} N m."
        )
    return Tile(f"{number(one.mean_size, 3)} N m", detail, hint)


def _share(system: Any, motion: Motion) -> Tile:
    share = motion.stick_share
    if not math.isfinite(share):
        return _UNKNOWN
    detail = "of the time, with the shaft" if _base(system) else "of the time at rest"
    hint = "Share of the time in which the brake does not slide."
    return Tile("0 %" if share == 0.0 else percent(share), detail, hint)


def _stability_sentence(found: DrivelineStability) -> str:
    ways = {"forwards": found.forward.state, "backwards": found.backward.state}
    for state, word in (("grows", "unstable"), ("does not decay", "neutral"), ("decays", "stable")):
        those = [way for way, one in ways.items() if one == state]
        if those:
            return f"Linearly {word}{'' if len(those) == len(ways) else f' {those[0]}'}."
    known = found.self_locking == "kinetic"
    return "" if known else "At the shaft's speed the brake locks itself."


def _motion_sentence(snapshot: Snapshot, about: ClassText) -> str:
    motion, sentence = snapshot.motion, about.headline
    if motion is None:
        return snapshot.message if snapshot.status != "completed" or snapshot.at_rest else sentence
    if snapshot.status in LIMITS and motion.kind not in ("at rest", "diverged", "self-locked"):
        return "The run reached its limit of steps or events; run fewer periods of the torque."
    if sentence.endswith("."):
        return sentence
    if motion.self_excited and motion.order:
        sentence = sentence.replace(",", f" {_frequency(motion)},", 1)
    return f"{sentence.format(order=motion.order)}{_sticks_clause(motion)}."


def _settling_sentence(state: PageState, motion: Motion) -> str:
    """A sentence if the verdict applies to periods after those in the pictures; otherwise ""."""
    repeats = motion.order > 0 or motion.kind == "at rest"
    later = math.isfinite(motion.settling) and motion.settling > state.periods
    if motion.self_excited or not (repeats and later):
        return ""
    begin = f"Settled from period {motion.settling:.0f} on"
    return f"{begin}; the pictures show the first {state.periods}."


def _sticks_clause(motion: Motion) -> str:
    if motion.stick_class == NON_STICK_SLIP:
        return ", without stick-slip" if _partly_held(motion) else ", without sticking"
    if motion.stick_class == BIDIRECTIONAL:
        return ", sticks in both directions"
    if motion.stick_class in (AT_REST, StickClass.NONE.word):
        return ""
    if not math.isfinite(motion.sticks_forward):
        return ""
    return f", sticks from {_side(motion)} sliding only"
