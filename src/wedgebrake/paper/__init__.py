"""The paper of Chen and Xi (2014): its parameters."""

from wedgebrake.paper.parameters import system

__all__ = ["system"]
