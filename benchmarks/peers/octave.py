"""GNU Octave: lsode on the smoothed law, with an interpreted right side, as its users write it."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from peers.brake import Brake
from peers.peer import Answers, Peer, spoken

PROGRAM = """
1;
function rates = brake(y, t, p)
  m = p.mu * tanh(p.steep * p.r * y(2));
  force = max(p.fa + p.slope * abs(y(2)), 0);
  torque = p.r * force * m / (p.tan - m);
  rates = [y(2); p.te * sin(p.om * t) - p.c * y(2) - p.k * y(1) - torque];
endfunction
given = jsondecode(fileread("given.json"));
lsode_options("relative tolerance", given.rtol);
lsode_options("absolute tolerance", given.rtol * 1e-2);
lsode_options("maximum step size", given.step);
lsode_options("step limit", 10000000);
states = zeros(numel(given.brakes), 2);
begin = tic;
for i = 1:numel(given.brakes)
  p = given.brakes(i);
  made = lsode(@(y, t) brake(y, t, p), [0; 0], [0, given.ends]);
  states(i, :) = made(end, :);
endfor
seconds = toc(begin);
printf("%.17g\\n", seconds, states');
"""


class Octave(Peer):
    """lsode, an implementation of LSODE by Hindmarsh."""

    law = "smoothed"
    name = "Octave lsode"

    def __init__(self, rtol: float, step: float) -> None:
        self.rtol, self.step = rtol, step
        self.asked = f"rtol {rtol:g}, steps ≤ {1e3 * step:g} ms"

    def missing(self) -> str:
        return "" if shutil.which("octave-cli") else "not installed"

    def solve(self, brakes: Sequence[Brake], until: float) -> Answers:
        with TemporaryDirectory() as folder:
            given = {
                "rtol": self.rtol,
                "step": self.step,
                "ends": until,  # "until" is a word of the language
                "brakes": [brake._asdict() for brake in brakes],
            }
            Path(folder, "given.json").write_text(json.dumps(given), encoding="utf-8")
            Path(folder, "program.m").write_text(PROGRAM, encoding="utf-8")
            words = spoken(["octave-cli", "--norc", "--quiet", "program.m"], folder).split()
        seconds, *states = map(float, words)
        return Answers(np.array(states).reshape(-1, 2), seconds)


def peers() -> list[Peer]:
    """One."""
    return [Octave(1e-8, 2e-3)]
