// SPDX-License-Identifier: MIT
// The real-space half: M_R = F (I - rr) + G rr as F I + C d d^T, from rows of neighbours [T7]; what
// follows, lanczos.cc, draws its square root. Lengths in radii, mobilities in 1/(6 pi eta a).
// A thread owns a row and adds its neighbours in their order: no sum is shared between threads.
// DEGREE_F and DEGREE_C are numbers, or entries of `plan` (PlanConstants). POLYNOMIALS_ALONE: without
// the branches of RPY.

#ifndef MIXTURE // else sphereRows.cc
// further places in the array of geometry
#define RANGE2 9
#define SCALE 10 // of t = scale r^2 - 1
#define SELF 11
#define REACH 12 // range as a fraction of the box widths, three numbers

/**
 * Rows of neighbours, [k][i]: from the cells around each particle, or with SUM_IMAGES every image of
 * every pair in range (few particles, or a range never chosen automatically).
 * @param counts   neighbours kept, at most `capacity`
 * @param largest  per group, the most neighbours that a particle has
 */
KERNEL void findNeighbours(int n, int capacity,
#ifdef SUM_IMAGES
        int numImages, GLOBAL const fraction4* RESTRICT places, GLOBAL const real4* RESTRICT images,
        GLOBAL const real* RESTRICT geometry, GLOBAL int2* RESTRICT neighbours,
#else
        int4 cells, GLOBAL const fraction4* RESTRICT places, GLOBAL const int* RESTRICT cellStart,
        GLOBAL const real* RESTRICT geometry, GLOBAL int* RESTRICT neighbours,
#endif
        GLOBAL int* RESTRICT counts, GLOBAL real* RESTRICT largest) {
    LOCAL real buffer[GROUP_SIZE];
    real most = 0;
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE) {
        const fraction4 own = places[i];
        int found = 0;
#ifdef SUM_IMAGES
        for (int j = 0; j < n; j++) {
            const real4 d = displacement(own, places[j], geometry);
            for (int m = 0; m < numImages; m++) {
                const real4 image = images[m];
                const real4 r = make_real4(d.x+image.x, d.y+image.y, d.z+image.z, 0);
                if (lengthSquared(r) < geometry[RANGE2] && (i != j || image.w != 0)) {
                    if (found < capacity)
                        neighbours[found*(mm_long) n+i] = make_int2(j, m);
                    found++;
                }
            }
        }
#else
        const real x = fromFraction(own.x), y = fromFraction(own.y), z = fromFraction(own.z);
        const int2 alongX = cellInterval(x-geometry[REACH], x+geometry[REACH], cells.x);
        const int2 alongY = cellInterval(y-geometry[REACH+1], y+geometry[REACH+1], cells.y);
        const int2 alongZ = cellInterval(z-geometry[REACH+2], z+geometry[REACH+2], cells.z);
        for (int column = 0; column < 2*alongX.y*alongY.y; column++) {
            const int cx = wrapped(alongX.x+column/(2*alongY.y), cells.x);
            const int cy = wrapped(alongY.x+column/2%alongY.y, cells.y);
            const int2 run = runOfPlaces(cellStart+(cx*cells.y+cy)*cells.z, alongZ, cells.z, column%2);
            for (int j = run.x; j < run.y; j++)
                if (lengthSquared(displacement(own, places[j], geometry)) < geometry[RANGE2] && j != i) {
                    if (found < capacity)
                        neighbours[found*(mm_long) n+i] = j;
                    found++;
                }
        }
#endif
        counts[i] = found < capacity ? found : capacity;
        most = larger(most, (real) found);
    }
    most = largestInGroup(buffer, most);
    if (LOCAL_ID == 0)
        largest[MOST_NEIGHBOURS*NUM_GROUPS+GROUP_ID] = most;
}

DEVICE real polynomial(GLOBAL const real* RESTRICT coefficients, int degree, real t) {
    real sum = coefficients[0];
    for (int power = 1; power <= degree; power++)
        sum = sum*t+coefficients[power];
    return sum;
}

/**
 * F and C of a pair.
 * @param tables  polynomials to be subtracted (RealTable), F's [DEGREE_F+1] and C's [DEGREE_C+1], highest power
 * first
 */
DEVICE real2 pairScalars(real r2, GLOBAL const int* RESTRICT plan, GLOBAL const real* RESTRICT geometry, GLOBAL const real* RESTRICT tables) {
    const real t = geometry[SCALE]*r2-1;
    const real waveF = polynomial(tables, DEGREE_F, t), waveC = polynomial(tables+DEGREE_F+1, DEGREE_C, t);
#ifdef POLYNOMIALS_ALONE
    return make_real2(-waveF, -waveC);
#else
    // C counts for nothing where 1/r^2 could overflow
    if (r2 < (real) SMALLEST_R2)
        return make_real2(1-waveF, 0);
    const real r = SQRT(r2), s = 1/r;
    real F, G;
    if (r < (real) CONTACT) {
        F = 1+(real) OVERLAP_F1*r;
        G = 1+(real) OVERLAP_G1*r;
    }
    else {
        F = s*((real) APART_F1+(real) APART_F3*s*s);
        G = s*((real) APART_G1+(real) APART_G3*s*s);
    }
    return make_real2(F-waveF, (G-F)*s*s-waveC);
#endif
}

/** Row i of M_R times v. */
DEVICE real4 rowProduct(int i, int n, GLOBAL const int* RESTRICT plan, GLOBAL const fraction4* RESTRICT places,
#ifdef SUM_IMAGES
        GLOBAL const real4* RESTRICT images, GLOBAL const int2* RESTRICT neighbours,
#else
        GLOBAL const int* RESTRICT neighbours,
#endif
        GLOBAL const int* RESTRICT counts, GLOBAL const real* RESTRICT geometry,
        GLOBAL const real* RESTRICT tables, GLOBAL const real4* RESTRICT v) {
    const fraction4 own = places[i];
    const real4 mine = v[i];
    real x = geometry[SELF]*mine.x, y = geometry[SELF]*mine.y, z = geometry[SELF]*mine.z;
    const int count = counts[i];
    for (int k = 0; k < count; k++) {
#ifdef SUM_IMAGES
        const int2 entry = neighbours[k*(mm_long) n+i];
        const int j = entry.x;
        const real4 image = images[entry.y];
        real4 d = displacement(own, places[j], geometry);
        d.x += image.x;
        d.y += image.y;
        d.z += image.z;
#else
        const int j = neighbours[k*(mm_long) n+i];
        const real4 d = displacement(own, places[j], geometry);
#endif
        const real4 w = v[j];
        const real2 pair = pairScalars(lengthSquared(d), plan, geometry, tables);
        const real along = pair.y*(d.x*w.x+d.y*w.y+d.z*w.z);
        x += pair.x*w.x+along*d.x;
        y += pair.x*w.y+along*d.y;
        z += pair.x*w.z+along*d.z;
    }
    return make_real4(x, y, z, 0);
}

#ifdef SUM_IMAGES
#define MATRIX_PARAMETERS int n, GLOBAL const int* RESTRICT plan, GLOBAL const fraction4* RESTRICT places, GLOBAL const real4* RESTRICT images, \
        GLOBAL const int2* RESTRICT neighbours, GLOBAL const int* RESTRICT counts, \
        GLOBAL const real* RESTRICT geometry, GLOBAL const real* RESTRICT tables
#define ROW_PRODUCT(i, v) rowProduct(i, n, plan, places, images, neighbours, counts, geometry, tables, v)
#else
#define MATRIX_PARAMETERS int n, GLOBAL const int* RESTRICT plan, GLOBAL const fraction4* RESTRICT places, GLOBAL const int* RESTRICT neighbours, \
        GLOBAL const int* RESTRICT counts, GLOBAL const real* RESTRICT geometry, GLOBAL const real* RESTRICT tables
#define ROW_PRODUCT(i, v) rowProduct(i, n, plan, places, neighbours, counts, geometry, tables, v)
#endif

#endif

/** u = M_R f */
KERNEL void multiplyReal(MATRIX_PARAMETERS, GLOBAL const real4* RESTRICT f, GLOBAL real4* RESTRICT u) {
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE)
        u[i] = ROW_PRODUCT(i, f);
}
