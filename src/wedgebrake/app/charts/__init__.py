"""Charts of one motion: history, phase portrait, Poincare section, spectrum."""
