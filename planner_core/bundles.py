"""Named tuples of arrays that kernels take as one pointer.

Numba passes a named tuple as all its members, and an array as seven values: a call with a
``Track`` had more than two hundred arguments, each written out at every step of compilation, which
took most of the compilation time. A class decorated with ``bundle`` is laid out in memory instead
when Python calls a kernel, and its members are read from there when they are used.

That memory never changes while the kernel runs (the arrays' elements may). The loads tell the
optimizer so, which keeps members in registers as it did before. Kernels read members by name and
pass a bundle on as it is; they can neither make nor return one. A bundle within a bundle lies in
the same memory and is passed on as a pointer too.
"""

from __future__ import annotations

import hashlib
from functools import cached_property
from typing import Any, Final, TypeVar

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate
from numba.core.typing.typeof import typeof, typeof_impl
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    unbox,
)

T = TypeVar("T", bound=tuple[Any, ...])

_WORD: Final = 8  # bytes
_I8: Final = ir.IntType(8)
_I64: Final = ir.IntType(64)


class BundleType(types.Type):
    """The type of a named tuple's class with members of certain types, in the tuple's order."""

    def __init__(self, of: type, members: tuple[types.Type, ...]):
        self.of = of
        self.members = members
        names: Any = of  # a named tuple's class, which the annotation cannot say
        # Stored on disk with compiled code: other member names make a different bundle.
        self.names: tuple[str, ...] = names._fields
        spelt = hashlib.sha256(repr((self.names, members)).encode()).hexdigest()[:8]
        super().__init__(name=f"{of.__name__}.{spelt}")

    @property
    def key(self) -> tuple[type, tuple[str, ...], tuple[types.Type, ...]]:
        """The values that identify the type."""
        return self.of, self.names, self.members

    @cached_property
    def places(self) -> dict[str, tuple[int, types.Type]]:
        """The word at which each member begins, and its type."""
        found, word = {}, 0
        for name, member in zip(self.names, self.members, strict=True):
            found[name] = word, member
            word += _words(member)
        return found

    @property
    def num_words(self) -> int:
        """The memory that the members take, in words."""
        return sum(_words(member) for member in self.members)


def _inside(member: Any) -> tuple[types.Type, ...] | None:
    """Return the types of the members of a bundle or tuple; None for anything else."""
    if isinstance(member, BundleType):
        return member.members
    held: Any = member
    return tuple(held.types) if isinstance(member, types.BaseTuple) else None


def _words(member: types.Type) -> int:
    """Return the number of words: data pointer and shape for an array, one for a scalar."""
    inside = _inside(member)
    if inside is not None:
        return sum(map(_words, inside))
    if not isinstance(member, types.Array):
        return 1
    if member.layout != "C":
        raise TypeError(f"an array in a bundle must be contiguous, not {member}")
    return 1 + int(member.ndim)


def bundle(of: type[T]) -> type[T]:
    """Mark a named tuple's class: kernels take its instances as one pointer."""

    def typeof_bundle(value: T, _: object) -> BundleType:
        return BundleType(of, tuple(typeof(member) for member in value))

    typeof_impl.register(of)(typeof_bundle)
    return of


@register_model(BundleType)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, bundle_type: BundleType):
        super().__init__(manager, bundle_type, _I8.as_pointer())


@infer_getattr
class _Attributes(AttributeTemplate):
    key = BundleType

    def generic_resolve(  # type: ignore[override]  # numba has a constant
        self, bundle_type: BundleType, name: str
    ) -> types.Type | None:
        place = bundle_type.places.get(name)
        return place[1] if place else None


def _at(builder: Any, base: Any, word: int, kind: Any) -> Any:
    """Return a pointer to the value at ``word``."""
    return builder.bitcast(
        builder.gep(base, [_I64(_WORD * word)], inbounds=True), kind.as_pointer()
    )


def _load(builder: Any, base: Any, word: int, kind: Any) -> Any:
    loaded = builder.load(_at(builder, base, word, kind))
    loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
    return loaded


@lower_getattr_generic(BundleType)
def _member(context: Any, builder: Any, bundle_type: BundleType, base: Any, name: str) -> Any:
    word, member = bundle_type.places[name]
    return _read(context, builder, member, base, word)


def _read(context: Any, builder: Any, member: types.Type, base: Any, word: int) -> Any:
    """Return the value at ``word``."""
    if isinstance(member, BundleType):
        return _at(builder, base, word, _I8)
    inside = _inside(member)
    if inside is not None:
        items = []
        for inner in inside:
            items.append(_read(context, builder, inner, base, word))
            word += _words(inner)
        return context.make_tuple(builder, member, items)
    if isinstance(member, types.Array):
        return _read_array(context, builder, member, base, word)
    model = context.data_model_manager[member]
    return model.from_data(builder, _load(builder, base, word, model.get_data_type()))


def _read_array(context: Any, builder: Any, member: types.Array, base: Any, word: int) -> Any:
    array = context.make_array(member)(context, builder)
    element = context.get_data_type(member.dtype)
    itemsize = context.get_constant(types.intp, context.get_abi_sizeof(element))
    shape = [_load(builder, base, word + 1 + axis, _I64) for axis in range(member.ndim)]
    strides, step = [], itemsize
    for length in reversed(shape):
        strides.append(step)
        step = builder.mul(step, length)
    num_items = context.get_constant(types.intp, 1)
    for length in shape:
        num_items = builder.mul(num_items, length)
    array.data = _load(builder, base, word, element.as_pointer())
    array.shape = cgutils.pack_array(builder, shape)
    array.strides = cgutils.pack_array(builder, strides[::-1])
    array.itemsize = itemsize
    array.nitems = num_items
    array.meminfo = cgutils.get_null_value(array.meminfo.type)  # the caller holds the array
    array.parent = cgutils.get_null_value(array.parent.type)
    return array._getvalue()


@unbox(BundleType)
def _unbox(bundle_type: BundleType, instance: Any, c: Any) -> NativeValue:
    memory = cgutils.alloca_once(c.builder, ir.ArrayType(_I64, bundle_type.num_words))
    base = c.builder.bitcast(memory, _I8.as_pointer())
    is_error = cgutils.alloca_once_value(c.builder, cgutils.false_bit)
    _lay(c, base, 0, bundle_type, instance, is_error)
    return NativeValue(_settled(c.builder, base), is_error=c.builder.load(is_error))


def _lay(c: Any, base: Any, word: int, member: types.Type, item: Any, is_error: Any) -> None:
    """Write a Python object to ``word``, its members one after another."""
    inside = _inside(member)
    if inside is not None:
        for place, inner in enumerate(inside):
            _lay(c, base, word, inner, c.pyapi.tuple_getitem(item, place), is_error)
            word += _words(inner)
        return
    if isinstance(member, types.Array):
        _lay_array(c, base, word, member, item)
        return
    native = c.unbox(member, item)
    with c.builder.if_then(native.is_error, likely=False):
        c.builder.store(cgutils.true_bit, is_error)
    data = c.context.data_model_manager[member].as_data(c.builder, native.value)
    c.builder.store(data, _at(c.builder, base, word, data.type))


def _lay_array(c: Any, base: Any, word: int, member: types.Array, item: Any) -> None:
    array = c.context.make_array(member)(c.context, c.builder)
    pointer = c.builder.bitcast(array._getpointer(), _I8.as_pointer())
    # It takes no reference of its own: the caller's tuple holds the array meanwhile.
    kind = ir.FunctionType(ir.IntType(32), [item.type, pointer.type])
    adapt = cgutils.get_or_insert_function(c.builder.module, kind, "numba_adapt_ndarray")
    c.builder.call(adapt, [item, pointer])
    c.builder.store(array.data, _at(c.builder, base, word, array.data.type))
    for axis, length in enumerate(cgutils.unpack_tuple(c.builder, array.shape, member.ndim)):
        c.builder.store(length, _at(c.builder, base, word + 1 + axis, _I64))


def _settled(builder: Any, base: Any) -> Any:
    """Return the pointer as one that the optimizer knows nothing about.

    A load marked invariant may move up to where its pointer is made, but not above this call.
    """
    barrier = ir.InlineAsm(
        ir.FunctionType(base.type, [base.type]), "", "=r,0,~{memory}", side_effect=True
    )
    return builder.call(barrier, [base])
