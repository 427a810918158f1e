"""Defaults of the properties of Bokeh's models, looked up once per class instead of once per model.

A page has hundreds of models with dozens of properties each, and most of them have their defaults.
Bokeh evaluates the defaults for each model when it is created, when models that refer to each other
are searched for, and when they are written: more than half of the time in which a page opens.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import bokeh
from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor

_VERSION = "3.9."
"""Beginning of the versions of Bokeh whose methods are replaced; others are left as they are."""
_get_default_anew = PropertyDescriptor._get_default


def look_up_defaults_once() -> None:
    """Replace methods of Bokeh in this process by equivalent ones."""
    if bokeh.__version__.startswith(_VERSION):
        replaced: Any = HasProps, PropertyDescriptor
        replaced[0].themed_values = _themed_values
        replaced[1].has_unstable_default = lambda one, model: _is_unstable(one, type(model))
        replaced[1]._get_default = _get_default


def _themed_values(model: HasProps) -> Any:
    """Return the values of a theme, or None, without a search for similar names of attributes."""
    return model.__dict__.get("__themed_values__")


@cache
def _is_unstable(descriptor: Any, cls: type[HasProps]) -> bool:
    """Return True if each model has a default of its own, such as a list."""
    default = cls._overridden_defaults().get(descriptor.name)
    return bool(
        descriptor.property._may_have_unstable_default() or descriptor.is_unstable(default)
    )


@cache
def _stable_default(descriptor: Any, cls: type[HasProps]) -> Any:
    return descriptor.class_default(cls)


def _get_default(descriptor: Any, model: HasProps) -> Any:
    cls = type(model)
    if model.themed_values() is None and not _is_unstable(descriptor, cls):
        return _stable_default(descriptor, cls)
    return _get_default_anew(descriptor, model)
