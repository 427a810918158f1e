"""Mutation check of the tests: ``python benchmarks/mutants.py [--count 40] [--seed 1]``.

Changes one line of the sources at a time (a comparison, an operator, a number or a condition) in a
copy of the project, and runs the tests of its chapter until one fails. Lists the mutants that no
test catches; the exit status is 1 if there are more than a tenth.

Compiled kernels are compiled anew for each mutant of one: expect one to three minutes per mutant.
Run the tests before: mutants of other files then use the kernels that are compiled already.
"""

import argparse
import ast
import itertools
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
# Tests of each chapter: ``unit/test_WORD*``, or a pattern below ``tests``.
CHAPTERS = {
    "model": """
        study groups char units full_disk friction_tables bad_input signals machine_model
        machine_study cli display driveline_signals literature/test_linear* stability
        literature/test_paper* paper_figures bad_parts signal_features tied testing driven
        joints controllers drag one_way normal_force machine_pieces
    """,
    "dynamics": """
        event_driven char rounding stability measures machine_solver smooth vibration
        properties motion_truth
    """,
    "solvers": """
        machine_solver event_driven smooth simd torque bad_input machine_[cps] interrupts
        driveline_signals properties motion_truth sensitivity sampling touching driven joints
        controllers drag one_way normal_force machine_truth
    """,
    "analysis": """
        motion saltation energy torque measures s[ep][te] vibration stopping order_map
        temperature growth machine_m speed_limits stability bad_input hopf
        literature/test_machine_stability* motion_truth fit sensitivity equilibrium check
        settling invariant one_layout driveline_signals
    """,
    "orbits": """
        orbit segment branches codim2 machine_[bops] hopf_branches rounding
        properties/test_orbit* peers/test_multipliers* orbits_of_parts response_curve touching
        hopf
    """,
    "sweeps": """
        sweep measures store cluster cli_sweep machine_m driveline_signals scatter margin
        rare_event tied given_axes cli_scatter cli_margin
    """,
}
COMPARISONS = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
# Arguments that document a parameter, or check what cannot fail.
NOT_COMPUTED = ("description", "example", "symbol", "unit", "strict")
OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}


class Mutant(NamedTuple):
    """A change of one expression: its file, line, and the text before and after."""

    path: Path
    line: int
    before: str
    after: str
    text: str


def _changed(node):
    """Return a node that computes something else, or None."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
        operators = [COMPARISONS[type(node.ops[0])](), *node.ops[1:]]
        return ast.Compare(node.left, operators, node.comparators)
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
    if isinstance(node, ast.BoolOp):
        other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        return ast.BoolOp(other, node.values)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return node.operand
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return ast.Constant(1 if node.value == 0 else 2 * node.value)
    if isinstance(node, ast.Constant) and type(node.value) is bool:
        return ast.Constant(not node.value)
    return None


def _is_setting(node):
    """Return True for a constant of a module or a member of an enumeration, given as a number.

    Twice the number is another setting, which need not be wrong. Code for type checkers never runs.
    """
    if isinstance(node, ast.If):
        return ast.unparse(node.test) == "TYPE_CHECKING"
    return isinstance(node, ast.Assign) and not any(
        isinstance(one, ast.Name) for one in ast.walk(node.value)
    )


def _expressions(node):
    """Yield the expressions that compute: not annotations, defaults, messages or imports."""
    skipped = (ast.Raise, ast.JoinedStr, ast.Import, ast.ImportFrom, ast.Assert)
    settings = isinstance(node, ast.Module | ast.ClassDef)
    for name, child in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "defaults", "kw_defaults"):
            continue
        for one in child if isinstance(child, list) else [child]:
            if isinstance(one, ast.keyword) and one.arg in NOT_COMPUTED:
                continue
            if settings and _is_setting(one):
                continue
            if isinstance(one, ast.AST) and not isinstance(one, skipped):
                yield one
                yield from _expressions(one)


def mutants_of(path):
    """Every mutant of a file that is on one line."""
    source = path.read_text(encoding="utf-8")
    lines = source.splitlines(keepends=True)
    for node in _expressions(ast.parse(source)):
        if not isinstance(node, ast.expr) or node.lineno != node.end_lineno:
            continue
        changed = _changed(node)
        line = lines[node.lineno - 1].encode()
        if changed is None:
            continue
        before = line[node.col_offset : node.end_col_offset].decode()
        after = ast.unparse(changed)
        new = line[: node.col_offset] + f"({after})".encode() + line[node.end_col_offset :]
        text = "".join([*lines[: node.lineno - 1], new.decode(), *lines[node.lineno :]])
        yield Mutant(path, node.lineno, before, after, text)


def chosen(count, seed):
    """Random mutants of different lines, the same number in each chapter as far as possible."""
    chance = random.Random(seed)  # noqa: S311 - a choice of lines
    drawn = {}
    for chapter in CHAPTERS:
        files = sorted((ROOT / "src/wedgebrake" / chapter).rglob("*.py"))
        found = list(itertools.chain.from_iterable(map(mutants_of, files)))
        chance.shuffle(found)
        drawn[chapter] = list({(one.path, one.line): one for one in found}.values())
    turns = itertools.chain.from_iterable(itertools.zip_longest(*drawn.values()))
    return list(itertools.islice(filter(None, turns), count))


def patterns_of(chapter):
    """Patterns of the tests of a chapter below ``tests``."""
    tests = ROOT / "tests"
    for word in CHAPTERS[chapter].split():
        yield word if "/" in word or (tests / word).is_dir() else f"unit/test_{word}*"


def result_of(mutant, copy, limit):
    """Run the tests of the chapter on a copy of the project that holds the mutant.

    Returns "caught", "SURVIVED", or "endless" if they do not end.
    """
    place = copy / mutant.path.relative_to(ROOT)
    chapter = mutant.path.relative_to(ROOT / "src/wedgebrake").parts[0]
    tests = [one for pattern in patterns_of(chapter) for one in (copy / "tests").glob(pattern)]
    # First those that share words with the file, which most often catch the mutant.
    words = set(mutant.path.stem.split("_"))
    tests = sorted(dict.fromkeys(tests), key=lambda one: -len(words & set(one.stem.split("_"))))
    place.write_text(mutant.text, encoding="utf-8")
    try:
        done = subprocess.run(  # noqa: S603 - our own tests
            [sys.executable, "-m", "pytest", "-xq", "-m", "not slow", "-p", "no:cacheprovider",
             *map(str, tests)],
            cwd=copy, env={**os.environ, "PYTHONPATH": str(copy / "src")}, timeout=limit,
            capture_output=True, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return "endless"
    finally:
        # The source, and the kernels that have been compiled for the mutant.
        shutil.copytree(ROOT / "src", copy / "src", dirs_exist_ok=True)
    return "caught" if done.returncode != 0 else "SURVIVED"


def main():
    """Check the mutants and list those that survive."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds for one mutant")
    parser.add_argument("--part", default="1/1", help="I/N: every Nth mutant, from the Ith on")
    given = parser.parse_args()
    first, step = map(int, given.part.split("/"))
    mutants = chosen(given.count, given.seed)[first - 1 :: step]
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "project"
        kept = shutil.ignore_patterns(".git", ".venv", "out", ".*_cache")
        shutil.copytree(ROOT, copy, ignore=kept)
        for mutant in mutants:
            word = result_of(mutant, copy, given.limit)
            survivors += word == "SURVIVED"
            place = f"{mutant.path.relative_to(ROOT)}:{mutant.line}"
            print(f"{word:8} {place}: {mutant.before} -> {mutant.after}", flush=True)
    print(f"{len(mutants) - survivors} of {len(mutants)} caught")
    sys.exit(10 * survivors > len(mutants))


if __name__ == "__main__":
    main()
