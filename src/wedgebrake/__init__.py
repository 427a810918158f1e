"""wedgebrake: the vibration of self-amplified friction brakes.

    import wedgebrake as wb
    system = wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18, brake="wedge")
    wb.stability(system)                         # linear stability
    response = wb.simulate(system, periods=250)  # the exact response

The public names are listed in ``__init__.pyi`` and imported on first use, so that
``import wedgebrake`` loads nothing else.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
