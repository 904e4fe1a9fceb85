// SPDX-License-Identifier: MIT
// Positions as binary fractions of the box, along its vectors. Their differences wrap around by
// themselves, so that nearest images cost nothing, and resolve 2^-32 of the box (2^-64 in double).

#ifdef USE_DOUBLE_PRECISION
#define FRACTION_BITS 64
#define FRACTIONS 18446744073709551616.0
#define GRID_BITS 47 // a product with a grid dimension, at most 2^15, and what rounds it up must fit 63 bits
typedef mm_ulong fraction;
typedef mm_long signedFraction;
#ifdef __OPENCL_VERSION__
typedef ulong4 fraction4;
#else
typedef ulonglong4 fraction4;
#endif
#else
#define FRACTION_BITS 32
#define FRACTIONS 4294967296.0
#define GRID_BITS 32
typedef unsigned int fraction;
typedef int signedFraction;
typedef uint4 fraction4;
#endif

/** The fraction of a coordinate in units of its box vector, whatever the image. */
DEVICE fraction toFraction(mixed s) {
    s -= floor(s);
    if (!(s < 1)) // rounding, or not a number
        s = 0;
    return (fraction) (s*(mixed) FRACTIONS);
}

#if !defined(USE_DOUBLE_PRECISION) && !defined(USE_MIXED_PRECISION)
/** What s has beyond a whole number, which may be any number; 0 of what is not a number. */
DEVICE fraction toFixedPoint(real s) {
    s -= rint(s);
    return fabs(s) <= (real) 0.5 ? (fraction) (mm_long) rint(s*(real) FRACTIONS) : 0;
}

/**
 * The same of inverse times a coordinate, in floats, to 2^-26 of the box vector besides 2^-48 of the
 * product: a product of a million box lengths keeps no place in the box [T56]. Whole box vectors go
 * before it is rounded; fma() does so whether or not a compiler contracts what is around it.
 * @param inverse  two floats of which it is the sum, the second one below half a unit in the last
 * place of the first
 */
DEVICE fraction fractionOfProduct(real inverse, real rest, real x) {
    return toFixedPoint(fma(inverse, x, -rint(inverse*x)))+toFixedPoint(fma(rest, x, -rint(rest*x)));
}
#endif

DEVICE real fromFraction(fraction f) {
    return f*(real) (1/FRACTIONS);
}

/** The cell of a fraction among `cells` along its axis. */
DEVICE int cellOf(fraction f, int cells) {
    return (int) (((mm_ulong) (f >> (FRACTION_BITS-32))*(unsigned int) cells) >> 32);
}

/**
 * Cells [from, from+number), modulo `cells`, that hold every fraction in [low, high].
 * low > -1, high < 2
 */
DEVICE int2 cellInterval(real low, real high, int cells) {
    const int first = (int) floor(low*cells), number = (int) floor(high*cells)-first+1;
    if (number >= cells)
        return make_int2(0, cells);
    return make_int2(first < 0 ? first+cells : (first >= cells ? first-cells : first), number);
}

/** Index in [0, 2*count) back into [0, count). */
DEVICE int wrapped(int index, int count) {
    return index < count ? index : index-count;
}

/**
 * Begin and end of the places in cells [from, from+number) of one column of cells along the third
 * axis; part 1 is what wraps around.
 * @param column  starts of the column's cells and of what follows
 */
DEVICE int2 runOfPlaces(GLOBAL const int* RESTRICT column, int2 interval, int cells, int part) {
    const int end = interval.x+interval.y;
    if (part == 0)
        return make_int2(column[interval.x], column[end < cells ? end : cells]);
    return make_int2(column[0], end > cells ? column[end-cells] : column[0]);
}
