"""The class of motion of machines by long runs: what ``wb.motion`` of machines is measured by.

runs         returns of a machine by ``wb.simulate``: at periods of the signals, or at its events
parting      growth of the distance of neighbouring runs
judge        the verdict
systems      the cases of truth.json
draw         how their machines were drawn:  PYTHONPATH=tests python -m machine_truth.draw
make_truth   judges them again:  PYTHONPATH=src:tests python -m machine_truth.make_truth

The solver is trusted, and nothing of wedgebrake.analysis is used. Repetition, averages and the 0-1
test are those of tests/motion_truth.
"""
