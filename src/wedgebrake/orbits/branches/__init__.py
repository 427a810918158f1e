"""Branches of periodic orbits.

branch            one branch, point by point
branch_switching  branches that leave a bifurcation, and those already computed
hopf_start        first limit cycle near a Hopf point of steady sliding
"""
