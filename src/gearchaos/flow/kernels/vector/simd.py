"""Vectors of `WIDTH` floats as a Numba type, so that kernels on a pack of lanes read like scalar code.

LLVM would not vectorise kernels written as loops over lanes, since it unrolls short loops before it vectorises. Every
operation is the IEEE 754 operation on each element, so results do not depend on the vector length of the machine. With
the compiler off (NUMBA_DISABLE_JIT) the same functions work on NumPy arrays.
"""

from __future__ import annotations

import operator
from inspect import Parameter, Signature

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.typing import signature
from numba.core.typing.templates import ConcreteTemplate, infer_global
from numba.extending import intrinsic, lower_builtin, models, register_model

from gearchaos.flow.kernels.compilation import inlined
from gearchaos.flow.kernels.vector.constants import WIDTH

_DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)


class _VectorType(types.Type):
    """WIDTH floats."""


class _MaskType(types.Type):
    """WIDTH truth values."""


vector, mask = _VectorType(name=f"Vector{WIDTH}"), _MaskType(name=f"Mask{WIDTH}")


@register_model(_VectorType)
@register_model(_MaskType)
class _Model(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, _DOUBLES if fe_type is vector else _BITS)


def _call(builder, name, args, of=_DOUBLES, suffix=f"v{WIDTH}f64"):
    """Call an LLVM intrinsic on vectors, or on numbers of another type."""
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(of, [of] * len(args)), f"llvm.{name}.{suffix}")
    return builder.call(function, args)


def _address(context, builder, array_type, array, row):
    """Pointer to the vector that is row ``row`` of a contiguous array."""
    data = context.make_array(array_type)(context, builder, array).data
    offset = builder.mul(row, context.get_constant(types.intp, WIDTH))
    return builder.bitcast(builder.gep(data, [offset]), _DOUBLES.as_pointer())


@intrinsic
def load(typingctx, array, row):
    """Row ``row`` of a contiguous array of rows * WIDTH floats, of any shape, as a vector."""

    def codegen(context, builder, signature, args):
        return builder.load(_address(context, builder, signature.args[0], *args), align=8)

    return vector(array, types.intp), codegen


@intrinsic
def store(typingctx, array, row, value):
    """Write a vector to row ``row`` of a contiguous array of rows * WIDTH floats, of any shape."""

    def codegen(context, builder, signature, args):
        pointer = _address(context, builder, signature.args[0], *args[:2])
        builder.store(args[2], pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, vector), codegen


def _row(context, builder, array_type, array, first, number):
    """The vector that is row ``first + number`` of an array, where ``number`` is a Python int."""
    row = builder.add(first, context.get_constant(types.intp, number))
    return builder.load(_address(context, builder, array_type, array, row), align=8)


def _row_sums(builder, totals, matrix, states):
    """``totals[i]`` plus the products of row i of a matrix with the states, added in order; a total of None is 0.

    ``matrix`` is a function from i and j to a vector; ``states`` are vectors, each loaded once. The compiler cannot
    do this by itself in a loop that stores one result after the other to the array of the states.
    """
    sums = []
    for i, total in enumerate(totals):
        for j, state in enumerate(states):
            factor = matrix(i, j)
            total = builder.fmul(factor, state) if total is None else _call(builder, "fma", [factor, state, total])
        sums.append(total)
    return sums


def _store_rows(context, builder, array_type, array, first, values):
    """Write vectors to consecutive rows of an array, from row ``first`` on."""
    for number, value in enumerate(values):
        row = builder.add(first, context.get_constant(types.intp, number))
        builder.store(value, _address(context, builder, array_type, array, row), align=8)
    return context.get_dummy_value()


@intrinsic
def store_affine(typingctx, dims, array, matrix, before, after, cos, sin):
    """Write E w + c + a cos + b sin to d = len(dims) rows of the array from row ``after`` on.

    E (d, d), c (d,), a (d,) and b (d,) are in consecutive rows of the array from row ``matrix`` on, w (d,) from row
    ``before`` on; ``cos`` and ``sin`` are vectors. The terms are added in the order c, a cos, b sin, E w.
    """
    d = len(dims)

    def codegen(context, builder, signature, args):
        kind, (_, array, matrix, before, after, cos, sin) = signature.args[1], args
        rows = [_row(context, builder, kind, array, matrix, d * d + n) for n in range(3 * d)]
        totals = [_call(builder, "fma", [rows[d + i], cos, rows[i]]) for i in range(d)]
        totals = [_call(builder, "fma", [rows[2 * d + i], sin, totals[i]]) for i in range(d)]
        states = [_row(context, builder, kind, array, before, j) for j in range(d)]
        sums = _row_sums(builder, totals, lambda i, j: _row(context, builder, kind, array, matrix, i * d + j), states)
        return _store_rows(context, builder, kind, array, after, sums)

    return types.void(dims, array, types.intp, types.intp, types.intp, vector, vector), codegen


@intrinsic
def store_linear(typingctx, dims, array, matrix, tangents, before, after):
    """Write E v to d = len(dims) rows of ``tangents`` from row ``after`` on, with E (d, d) in consecutive rows of the
    array from row ``matrix`` on, and v (d,) in rows of ``tangents`` from row ``before`` on."""
    d = len(dims)

    def codegen(context, builder, signature, args):
        (_, kind, _, of_tangents, *_), (_, array, matrix, tangents, before, after) = signature.args, args
        states = [_row(context, builder, of_tangents, tangents, before, j) for j in range(d)]
        sums = _row_sums(
            builder, [None] * d, lambda i, j: _row(context, builder, kind, array, matrix, i * d + j), states)
        return _store_rows(context, builder, of_tangents, tangents, after, sums)

    return types.void(dims, array, types.intp, tangents, types.intp, types.intp), codegen


@intrinsic
def load_scalar(typingctx, array, index):
    """Element ``index``, not negative, of a contiguous array of any shape, flattened: faster than indexing by brackets,
    which tests for negative indices."""

    def codegen(context, builder, signature, args):
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        return builder.load(builder.gep(data, [args[1]]))

    return array.dtype(array, types.intp), codegen


@intrinsic
def store_scalar(typingctx, array, index, value):
    """Write element ``index`` of a contiguous array of any shape, flattened; the index must not be negative."""

    def codegen(context, builder, signature, args):
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        builder.store(args[2], builder.gep(data, [args[1]]))
        return context.get_dummy_value()

    return types.void(array, types.intp, array.dtype), codegen


@intrinsic
def store_bytes(typingctx, array, index, packed, offset):
    """Write each byte of the integer ``packed``, the lowest first, plus ``offset`` to `WIDTH` elements of a contiguous
    array of integers, from element ``index`` on."""

    def codegen(context, builder, signature, args):
        integers = ir.VectorType(ir.IntType(64), WIDTH)
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        parts = builder.zext(builder.bitcast(args[2], ir.VectorType(ir.IntType(8), WIDTH)), integers)
        pointer = builder.bitcast(builder.gep(data, [args[1]]), integers.as_pointer())
        builder.store(builder.add(parts, _emit_broadcast(builder, args[3], integers)), pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.int64, types.intp), codegen


def _operation(emit, result, *operands):
    """A Numba intrinsic on values of these types, whose LLVM code ``emit(builder, *values)`` writes."""

    def codegen(context, builder, signature, args):
        return emit(builder, *args)

    def definition(typingctx, *given):
        return result(*operands), codegen

    # Numba passes as many arguments as the signature has
    names = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in ("typingctx", *"abc"[: len(operands)])]
    vars(definition)["__signature__"] = Signature(names)
    return intrinsic(definition)


def _emit_broadcast(builder, value, kind=_DOUBLES):
    undefined = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(undefined, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))


def _emit_bits(builder, value):
    return builder.bitcast(value, ir.IntType(WIDTH))


# the vector with this float in every element
broadcast = _operation(_emit_broadcast, vector, types.float64)
# whether any element of the mask is true; the mask as an integer, its first element in the lowest bit
any_true = _operation(
    lambda b, x: b.icmp_unsigned("!=", _emit_bits(b, x), ir.Constant(ir.IntType(WIDTH), 0)), types.boolean, mask)
bits = _operation(lambda b, x: b.zext(_emit_bits(b, x), ir.IntType(64)), types.int64, mask)
# the elements of the second where the mask is true, else those of the third
select = _operation(ir.IRBuilder.select, vector, mask, vector, vector)
vfma = _operation(lambda b, *x: _call(b, "fma", x), vector, vector, vector, vector)
# a b + c of floats, rounded once
fma = _operation(lambda b, *x: _call(b, "fma", x, ir.DoubleType(), "f64"), *4 * [types.float64])
vsqrt, vabs = (_operation(lambda b, x, name=name: _call(b, name, [x]), vector, vector) for name in ("sqrt", "fabs"))


def _overload_operator(python, operand, method, result):
    """Compile a Python operator on two operands of type ``operand`` to the LLVM instruction of ``method``."""

    @infer_global(python)
    class Template(ConcreteTemplate):
        cases = (signature(result, operand, operand),)

    @lower_builtin(python, operand, operand)
    def implement(context, builder, signature, args):
        return method(builder, *args)


_overload_operator(operator.add, vector, ir.IRBuilder.fadd, vector)
_overload_operator(operator.sub, vector, ir.IRBuilder.fsub, vector)
_overload_operator(operator.mul, vector, ir.IRBuilder.fmul, vector)
_overload_operator(operator.truediv, vector, ir.IRBuilder.fdiv, vector)
_overload_operator(operator.lt, vector, lambda b, x, y: b.fcmp_ordered("<", x, y), mask)
_overload_operator(operator.gt, vector, lambda b, x, y: b.fcmp_ordered(">", x, y), mask)
_overload_operator(operator.le, vector, lambda b, x, y: b.fcmp_ordered("<=", x, y), mask)
_overload_operator(operator.eq, vector, lambda b, x, y: b.fcmp_ordered("==", x, y), mask)
_overload_operator(operator.and_, mask, ir.IRBuilder.and_, mask)
_overload_operator(operator.or_, mask, ir.IRBuilder.or_, mask)


def _numpy_load(array, row):
    return array.reshape(-1)[row * WIDTH : (row + 1) * WIDTH].copy()


def _numpy_store(array, row, value):
    array.reshape(-1)[row * WIDTH : (row + 1) * WIDTH] = value


def _numpy_rows(array, first, count):
    return [_numpy_load(array, first + n) for n in range(count)]


def _numpy_store_affine(dims, array, matrix, before, after, cos, sin):
    d = len(dims)
    constant, a, b = (_numpy_rows(array, matrix + d * d + n * d, d) for n in range(3))
    states = _numpy_rows(array, before, d)
    for i in range(d):
        total = b[i] * sin + (a[i] * cos + constant[i])
        for factor, state in zip(_numpy_rows(array, matrix + i * d, d), states, strict=True):
            total = factor * state + total
        _numpy_store(array, after + i, total)


def _numpy_store_linear(dims, array, matrix, tangents, before, after):
    d = len(dims)
    states = _numpy_rows(tangents, before, d)
    for i in range(d):
        factors = _numpy_rows(array, matrix + i * d, d)
        _numpy_store(tangents, after + i, sum(f * s for f, s in zip(factors, states, strict=True)))


def _numpy_store_scalar(array, index, value):
    array.reshape(-1)[index] = value


def _numpy_store_bytes(array, index, packed, offset):
    array[index : index + WIDTH] = (packed >> 8 * np.arange(WIDTH) & 255) + offset


if config.DISABLE_JIT:
    load, store, select, any_true = _numpy_load, _numpy_store, np.where, np.any
    store_affine, store_linear = _numpy_store_affine, _numpy_store_linear
    load_scalar, store_scalar = (lambda array, index: array.reshape(-1)[index]), _numpy_store_scalar
    store_bytes = _numpy_store_bytes
    vfma, vsqrt, vabs = (lambda a, b, c: a * b + c), np.sqrt, np.abs
    fma = vfma

    def broadcast(value):
        return np.full(WIDTH, float(value))

    def bits(value):
        return int(value @ (1 << np.arange(WIDTH)))


@inlined
def smaller(a, b):
    """The smaller of two vectors, element by element."""
    return select(a < b, a, b)


@inlined
def larger(a, b):
    """The larger of two vectors, element by element."""
    return select(a < b, b, a)
