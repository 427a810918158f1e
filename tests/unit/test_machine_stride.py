"""Cells of equal lengths: the motion with and without their matrices, and guards that are grazed."""
