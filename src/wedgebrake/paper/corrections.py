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
        "The identification: of five values the only one with which statements on bifurcation"
        " diagrams hold.",
    ),
    Correction(
        "Eq. (3), negative force",
        "F_a = F_a0 + δ|θ'|, without a bound.",
        "F_a = max(0, F_a0 + δ|θ'|): a wedge cannot pull.",
        "The identification; without it motions at strongly negative η or small F_0 diverge.",
    ),
    Correction(
        "Eq. (14), static peak",
        "μ_s = 0.33.",
        "μ_s = μ_k = 0.30 in the smoothed law.",
        "Figure 4's values, eqs. (17) and (18), statement M2 and the identification.",
    ),
    Correction(
        "Figure 4",
        "α = 1.03.",
        "α = 1.18, a wedge angle of 0.34 rad.",
        "1/(α − 1) = 5.58 and 1/(α + 1) = 0.459; with 1.03 they would be 33 and 0.49.",
    ),
    Correction(
        "Figures 6a and 7a",
        "F_0 = 0.12.",
        "F_0 = 0.036; see the open questions for the range that fits.",
        "At 0.12 the wedge sticks for most of the time (statement M1, as printed).",
    ),
    Correction(
        "Figures 14 to 16",
        "F_0 = 0.024 in the captions.",
        "F_0 = 0.036, as in figures 8 to 10.",
        "Statements B5, B6 and R6; see the open questions.",
    ),
    Correction(
        "Figures 14 to 16, frequencies",
        "f = 0.31, 0.56 or 0.57, 0.63, 0.69, 1.26, 1.57, 2.07.",
        "Torques of 5, 9, 10, 11, 20, 25 and 33 Hz.",
        "They are whole hertz over f_n, to the printed digits; 0.56 and 0.57 are the same 9 Hz, cut"
        " and rounded. At whole hertz 20 s are whole periods: only so has x_2(nT) one sign on each"
        " side of f = 1.",
    ),
    Correction(
        "Figure 17",
        "A limit at α = 1.41, where figure 11 has multi-periodic motion at 1.18.",
        "1.41 is the first column beyond the limit.",
        "But for 1.18 and 1.21 the printed values of α are tangents of tenths of a radian over μ_k,"
        " the last (8.60) to 0.3 %: columns 0.1 rad apart (statement B7).",
    ),
    Correction(
        "Section 4.3",
        "η = −24 induces the typical 2T-periodic motion of figure 8.",
        "Section 4.2 has multi-periodic motion there.",
        "The paper contradicts itself; what the smoothed law shows at η = −24 is said under"
        " smoothed against exact friction.",
    ),
    Correction(
        "Section 4.4",
        "The wedge's friction force is 12 times that of the conventional brake.",
        "18.6 times forwards and 1.5 times backwards; 12 is the wedge's forward over its backward"
        " force.",
        "g(±μ_k) of both brakes (statement K1).",
    ),
    Correction(
        "Section 5",
        "At η = −24 the wedge is synchronous for F_0 > 0.044, and for f > 0.3 or f > 1.57.",
        "F_0 > 0.072; f < 0.56 or f > 1.57.",
        "Section 4 says so: 0.044 is the conventional brake's limit there, and 0.3 the lowest"
        " frequency.",
    ),
)
