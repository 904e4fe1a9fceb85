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
