# SPDX-License-Identifier: MIT
"""Checks and conversions between what Python users write and what the C++ library takes.

Everything here returns plain numbers and arrays in OpenMM's units (nm, ps, Da, kJ/mol, K).
"""

import operator
from typing import TypedDict

import numpy
from openmm import unit

VISCOSITY_UNIT = unit.dalton / (unit.nanometer * unit.picosecond)
STRESS_UNIT = unit.kilojoule_per_mole / unit.nanometer**3
FORCE_UNIT = unit.kilojoule_per_mole / unit.nanometer
PARTICLES_PER_MOLE = unit.AVOGADRO_CONSTANT_NA.value_in_unit(unit.mole**-1)


class NumericalParameters(TypedDict):
    """What getNumericalParameters() returns; its documentation has meanings and units."""

    split: str
    xi: float
    realCutoff: float
    prolateBandwidth: float
    gridDimensions: tuple[int, int, int]
    windowSupport: int
    windowShape: float
    lanczosTolerance: float
    lanczosIterations: int
    predictedError: float
    precision: str
    instructions: str
    randomSeed: int


# What setNumericalParameters() takes, in the order of the C++ call, with the "automatic" value.
SETTABLE = {
    "split": "",
    "xi": 0.0,
    "realCutoff": 0.0,
    "prolateBandwidth": 0.0,
    "gridDimensions": (0, 0, 0),
    "windowSupport": 0,
    "windowShape": 0.0,
    "lanczosTolerance": 0.0,
    "randomSeed": 0,
}
UNITS = {"xi": unit.nanometer**-1, "realCutoff": unit.nanometer}
REPORTED = ("lanczosIterations", "predictedError", "precision", "instructions")


def _split(quantity, expected, name):
    """Return the bare value of a Quantity and the factor that brings it to the given unit.

    In openmm.unit a dalton is a gram per mole, so that Pa s and pN differ from dalton/(nm ps) and
    kJ/(mol nm) by a mole: those are meant per particle and accepted. Raises TypeError for other
    dimensions.
    """
    for particles, amount in ((1, unit.dimensionless), (PARTICLES_PER_MOLE, unit.mole)):
        given = quantity.unit / amount
        if given.is_compatible(expected):
            return quantity.value_in_unit(quantity.unit), particles * given.conversion_factor_to(
                expected
            )
    raise TypeError(
        f"{name}: expected a Quantity compatible with {_nameOf(expected)}, "
        f"got one in {quantity.unit}"
    )


def inUnit(value, expected, name):
    """Return a number or Quantity as a float in the given unit.

    Raises TypeError, naming the argument and the unit, for a Quantity of another dimension and for
    anything that is not a number.
    """
    if unit.is_quantity(value):
        value, factor = _split(value, expected, name)
    else:
        factor = 1
    if isinstance(value, (str, bytes)):
        raise TypeError(
            f"{name}: expected a number in {_nameOf(expected)} or a Quantity, got {value!r}"
        )
    try:
        return float(value) * factor
    except (TypeError, ValueError):
        raise TypeError(
            f"{name}: expected a number in {_nameOf(expected)} or a Quantity, got {value!r}"
        ) from None


def integer(value, name):
    """Return a Python int for any kind of integer, NumPy's included; else raise TypeError."""
    try:
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected an integer, got {value!r}") from None


def forceGroups(groups):
    """Return force groups as the bits of a C++ int: given as such, or as a set as OpenMM takes it."""
    if isinstance(groups, (set, frozenset)):
        groups = sum(1 << integer(group, "groups") for group in groups)
    return (integer(groups, "groups") + 2**31) % 2**32 - 2**31


def arrayOfForces(forces, count):
    """Return forces as a C-contiguous float64 array of shape (count, 3) in kJ/(mol nm).

    forces  (count, 3) array-like of numbers in kJ/(mol nm), or a Quantity of one
    count   expected number of particles; negative: any

    Raises TypeError for a Quantity that is not a force, ValueError for another shape (naming both),
    for entries that are no numbers and for those that are not finite (naming the first particle).
    """
    if unit.is_quantity(forces):
        forces, factor = _split(forces, FORCE_UNIT, "forces")
    else:
        factor = 1
    expected = f"({count if count >= 0 else 'N'}, 3)"
    try:
        array = numpy.asarray(forces)
    except ValueError as error:  # ragged
        raise ValueError(
            f"forces: expected an array of shape {expected}, got {_describe(forces)}: {error}"
        ) from None
    if array.size and array.dtype.kind not in "iuf":
        raise ValueError(
            f"forces: expected numbers in an array of shape {expected}, got {_describe(forces)}"
        )
    if array.ndim != 2 or array.shape[1] != 3 or (count >= 0 and array.shape[0] != count):
        raise ValueError(f"forces: expected an array of shape {expected}, got shape {array.shape}")
    array = numpy.ascontiguousarray(array * factor, dtype=numpy.float64)
    bad = numpy.flatnonzero(~numpy.isfinite(array).all(axis=1))
    if bad.size:
        raise ValueError(
            f"forces: not finite on particle {bad[0]}: {tuple(array[bad[0]].tolist())}, "
            f"shape {array.shape}"
        )
    return array


def numericalParameterArguments(parameters):
    """Turn a dict as getNumericalParameters() returns it into the arguments of the C++ call.

    Missing keys stay automatic, reported ones are ignored. Raises ValueError naming an unknown key
    and TypeError for a value of the wrong kind.
    """
    if not hasattr(parameters, "keys"):
        raise TypeError(
            "parameters: expected a dict as getNumericalParameters() returns it, "
            f"got {parameters!r}"
        )
    for key in parameters.keys():
        if key not in SETTABLE and key not in REPORTED:
            raise ValueError(
                f"parameters: unknown key {key!r}; known are {', '.join((*SETTABLE, *REPORTED))}"
            )
    return tuple(
        _settable(key, parameters[key] if key in parameters.keys() else automatic)
        for key, automatic in SETTABLE.items()
    )


def _settable(key, value):
    """One entry of the dict, in the type of its automatic value."""
    automatic = SETTABLE[key]
    if isinstance(automatic, str):
        if not isinstance(value, str):
            raise TypeError(f"{key}: expected a string, got {value!r}")
        return value
    if isinstance(automatic, tuple):
        try:
            numbers = tuple(integer(n, key) for n in value)
        except TypeError:
            numbers = ()
        if len(numbers) != len(automatic):
            raise TypeError(f"{key}: expected three integers, got {value!r}")
        return numbers
    if isinstance(automatic, int):
        return integer(value, key)
    return inUnit(value, UNITS.get(key, unit.dimensionless), key)


def _nameOf(expected):
    """A unit in words."""
    return "plain numbers (dimensionless)" if expected == unit.dimensionless else str(expected)


def _describe(value):
    """What was given instead of an array, briefly."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
