"""Kinds of option that tyro would read or show badly."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from operator import or_
from types import NoneType
from typing import Any, get_args

from tyro.constructors import (
    ConstructorRegistry,
    PrimitiveConstructorSpec,
    PrimitiveTypeInfo,
    UnsupportedTypeAnnotationError,
)

KINDS = ConstructorRegistry()
"""For `tyro`'s parameter registry."""


@KINDS.primitive_rule
def _optional(
    info: PrimitiveTypeInfo,
) -> PrimitiveConstructorSpec | UnsupportedTypeAnnotationError | None:
    """`X | None` as X: its default is called unset, and several numbers stand in no braces."""
    kinds = [kind for kind in get_args(info.type) if kind is not NoneType]
    if len(kinds) == len(get_args(info.type)):
        return None
    inner = PrimitiveTypeInfo.make(reduce(or_, kinds), info.markers)
    spec = ConstructorRegistry.get_primitive_spec(inner)
    if isinstance(spec, UnsupportedTypeAnnotationError):
        return spec
    metavar = re.sub(r"\{(\w+)\}", r"\1", spec.metavar)
    return replace(
        spec,
        metavar=metavar,
        instance_from_str=_teaching(spec.instance_from_str, metavar),
        is_instance=lambda value: value is None or spec.is_instance(value),
        str_from_instance=lambda v: ["unset"] if v is None else spec.str_from_instance(v),
    )


@KINDS.primitive_rule
def _numbers(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec | None:
    """Any number of integers, whose default, none, is called unset."""
    if info.type != tuple[int, ...]:
        return None
    return PrimitiveConstructorSpec(
        nargs="*",
        metavar="INT INT ...",
        instance_from_str=_teaching(lambda given: tuple(map(int, given)), "INT INT ..."),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda value: [str(part) for part in value] or ["unset"],
    )


def _teaching(read: Callable[[list[str]], Any], metavar: str) -> Callable[[list[str]], Any]:
    """`read`, with errors that say what is accepted."""

    def taught(given: list[str]) -> Any:
        try:
            return read(given)
        except ValueError as error:
            raise ValueError(f"{' '.join(given)}; {metavar} is accepted") from error

    return taught
