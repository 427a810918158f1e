"""Defaults of the properties of Bokeh's models: found once per class instead of once per model.

A page has hundreds of models with dozens of properties each, and most of them have their defaults.
Bokeh evaluates the defaults for each model when it is created, when the models that refer to each
other are collected, and when they are written: two thirds of the time it takes to open a page.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import bokeh
from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor
from bokeh.core.property.singletons import Intrinsic, Undefined
from bokeh.core.property.wrappers import PropertyValueContainer
from bokeh.model import util

_VERSION = "3.9."
"""Prefix of the versions of Bokeh whose methods are replaced; other versions are unchanged."""
_default_anew = PropertyDescriptor._get_default
_query = HasProps.query_properties_with_values
_visit = util.visit_immediate_value_references


def find_defaults_once() -> None:
    """Replace methods of Bokeh in this process by equivalent ones."""
    if bokeh.__version__.startswith(_VERSION):
        models: Any = HasProps
        models.__init__ = _initialize
        models.themed_values = _themed_values
        models.query_properties_with_values = _query_properties_with_values
        descriptors: Any = PropertyDescriptor
        descriptors.has_unstable_default = _has_unstable_default
        descriptors._get_default = _get_default
        util.visit_immediate_value_references = _visit_immediate_value_references


def _has_unstable_default(descriptor: Any, model: Any) -> bool:
    return _is_unstable(descriptor, model.__class__)


@cache
def _is_unstable(descriptor: Any, cls: Any) -> bool:
    """Return True if each model has a default of its own, such as a list or another model."""
    default = cls._overridden_defaults().get(descriptor.name)
    return bool(descriptor.property._may_have_unstable_default() or descriptor.is_unstable(default))


@cache
def _stable_default(descriptor: Any, cls: Any) -> Any:
    return descriptor.class_default(cls)


def _get_default(descriptor: Any, model: Any) -> Any:
    cls = model.__class__
    if model.themed_values() is None and not _is_unstable(descriptor, cls):
        return _stable_default(descriptor, cls)
    return _default_anew(descriptor, model)


def _own(cls: Any) -> list[Any]:
    """Return the properties of a class, without aliases."""
    found = map(cls.lookup, cls.properties(_with_props=True))
    return [one for one in found if isinstance(one, PropertyDescriptor)]


@cache
def _made_at_first(cls: Any) -> list[Any]:
    """Return the properties whose defaults a new model needs: not lists, which are not written."""
    unstable = [one for one in _own(cls) if _is_unstable(one, cls)]
    return [
        one for one in unstable if not isinstance(one.class_default(cls), PropertyValueContainer)
    ]


@cache
def _required(cls: Any) -> set[str]:
    """Return the names of the properties that have no default."""
    stable = [one for one in _own(cls) if not _is_unstable(one, cls)]
    return {one.name for one in stable if _stable_default(one, cls) is Undefined}


def _is_usual(model: Any) -> bool:
    """Return True for a model without a theme in which all values without default are given."""
    return (
        model.themed_values() is None
        and _required(model.__class__) <= model._property_values.keys()
    )


def _initialize(model: Any, **properties: Any) -> None:
    super(HasProps, model).__init__()
    model._property_values = {}
    model._unstable_default_values, model._unstable_themed_values = {}, {}
    for name, value in properties.items():
        if value is not Undefined and value is not Intrinsic:
            setattr(model, name, value)
    for descriptor in _made_at_first(model.__class__):
        if descriptor.name not in properties:
            descriptor._get(model)
    model._initialized = True


def _themed_values(model: HasProps) -> Any:
    """Return the values of a theme, or None, without a search for similar names of attributes."""
    return model.__dict__.get("__themed_values__")


def _query_properties_with_values(
    model: Any, query: Callable[[Any], bool], *, include_defaults: bool = True, **options: bool
) -> dict[str, Any]:
    """Return the values that are not defaults, without evaluating defaults."""
    if include_defaults or not _is_usual(model):
        return _query(model, query, include_defaults=include_defaults, **options)
    made = model._unstable_default_values
    found = {}
    for name in model.properties(_with_props=True):
        if name in model._property_values or (
            name in made and not isinstance(made[name], PropertyValueContainer)
        ):
            descriptor = model.lookup(name)
            if query(descriptor):
                found[name] = descriptor.get_value(model)
    return found


def _visit_immediate_value_references(value: Any, visitor: Callable[[Any], None]) -> None:
    """Visit the models to which a value refers; a default not yet created refers to none."""
    if not isinstance(value, HasProps) or not _is_usual(value):
        _visit(value, visitor)
        return
    for name in value.properties_with_refs():
        for values in (value._property_values, value._unstable_default_values):
            if name in values:
                util.visit_value_and_its_immediate_references(values[name], visitor)
