"""Adaptive solution for smooth friction laws: Taylor series and Runge-Kutta."""
