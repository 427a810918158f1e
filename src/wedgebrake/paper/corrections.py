"""What the paper prints and what it must have computed, where the two differ."""

from __future__ import annotations

from typing import NamedTuple


class Correction(NamedTuple):
    """One place.

    where     : equation, figure or section
    printed   : what stands there
    corrected : what is used here
    evidence  : why
    """

    where: str
    printed: str
    corrected: str
    evidence: str


CORRECTIONS = (
    Correction(
        "Eq. (5), at rest",
        "Lower bound of the holding force with tan α_w − μ_s, like the upper one.",
        "−F_a μ_s/(tan α_w + μ_s).",
        "It follows from eqs. (2) and (4); the paper's own eq. (18) has the right sign.",
    ),
    Correction(
        "Eq. (14)",
        "μ(v_r) = [1 + (μ_s/μ_k − 1) exp(−ς|v_r|)] tanh(ξ v_r), which tends to 1.",
        "The same times μ_k.",
        "Figure 4 has F_μ/F_a = 5.58 and 0.46, which are g(±μ_k).",
    ),
    Correction(
        "Section 4, damping",
        "c = 1 N m s/rad (section 3), no other value.",
        "c = 0.1 N m s/rad, so that δ = η/0.6 N s/rad.",
        "The identification below: no statement of figures 8 to 13 on a bifurcation diagram holds"
        " with any other of five values. Every η that is printed is then a slope of a multiple of"
        " 10 N s/rad.",
    ),
    Correction(
        "Eq. (3), negative force",
        "F_a = F_a0 + δ|θ'|, without a bound.",
        "F_a = max(0, F_a0 + δ|θ'|): a wedge cannot pull.",
        "Without it the motion diverges wherever the paper shows a steady one at η < 0.",
    ),
    Correction(
        "Eq. (14), static peak",
        "μ_s = 0.33.",
        "μ_s = μ_k = 0.30 in the smoothed law.",
        "Figure 4's values, eqs. (17) and (18), figure 6b's bidirectional stick-slip, and the"
        " limits of figure 11.",
    ),
    Correction(
        "Figure 4",
        "α = 1.03.",
        "α = 1.18, a wedge angle of 0.34 rad.",
        "1/(α − 1) = 5.58 and 1/(α + 1) = 0.459; with 1.03 the ratio would be 33.",
    ),
    Correction(
        "Figures 6a and 7a",
        "F_0 = 0.12.",
        "F_0 = 0.036; any value up to about 0.04 gives what is described.",
        "At 0.12 the wedge sticks for most of the time, whatever c and μ_s.",
    ),
    Correction(
        "Figures 14 to 16",
        "F_0 = 0.024 in the captions.",
        "F_0 = 0.036, as in figures 8 to 10.",
        "Both upper limits (1.57), the conventional brake's lower one (0.69) and its clean"
        " spectrum at f = 2.07 need it.",
    ),
    Correction(
        "Figures 14 to 16, frequencies",
        "f = 0.31, 0.56 or 0.57, 0.63, 0.69, 1.26, 1.57, 2.07.",
        "Torques of 5, 9, 10, 11, 20, 25 and 33 Hz.",
        "All agree with whole hertz to their digits, and 0.56 and 0.57 are the same 9 Hz, cut and"
        " rounded. At whole hertz 20 s are whole periods: only so has x_2(nT) one sign on each side"
        " of f = 1.",
    ),
    Correction(
        "Figure 17",
        "A limit at α = 1.41, where figure 11 has multi-periodic motion at 1.18.",
        "The limit lies between the columns 1.03 and 1.41, near 1.04.",
        "The printed values of α are tangents of tenths of a radian over μ_k, but for 1.18 and"
        " 1.21: these columns were computed, and 1.41 is the first one that is not synchronous.",
    ),
    Correction(
        "Section 4.4",
        "The wedge's friction force is 12 times that of the conventional brake.",
        "18.6 times forwards and 1.5 times backwards; 12 is the wedge's forward over its backward"
        " force.",
        "g(±μ_k) of both brakes.",
    ),
)
