// SPDX-License-Identifier: MIT
// Rows of the real half for unequal spheres [T25, T26]: as in realSpace.cc, M_R = F I + C d d^T, but
// each pair has a range of its own, and F and C are evaluated once in a step and kept. Particles are
// in groups of like radii, one group after the other; the rows of a group have one length.
// BASIS (radii of the table) and TABLE_DEGREE are numbers, or entries of `plan` (PlanConstants).

// further places in the array of geometry, lengths in the Plan's unit
#define ENVELOPE 9    // range of point forces; the radii of a pair add to it
#define SCALE 10      // of t = scale r^2 - 1
#define PER_LENGTH 11 // a length as a fraction of the box widths, three numbers

/** Where the entries of a row are: first+k*stride. */
typedef struct {
    mm_long first;
    int stride, capacity;
} Row;

/** @param groupRows  of each group its first place, its particles and the length of its rows */
DEVICE Row rowOf(int place, int sizeGroups, GLOBAL const int4* RESTRICT groupRows) {
    mm_long before = 0;
    int g = 0;
    for (; g < sizeGroups-1 && place >= groupRows[g+1].x; g++)
        before += groupRows[g].y*(mm_long) groupRows[g].z;
    Row row;
    row.first = before+place-groupRows[g].x;
    row.stride = groupRows[g].y;
    row.capacity = groupRows[g].z;
    return row;
}

#ifdef SUM_IMAGES
typedef int2 Neighbour; // place and image
#define IMAGES GLOBAL const real4* RESTRICT images,
#define NEIGHBOUR_PLACE(entry) (entry).x
#else
typedef int Neighbour;
#define IMAGES
#define NEIGHBOUR_PLACE(entry) (entry)
#endif

/** A range as a fraction of a box width, and somewhat more: what rounding of fractions may do. */
DEVICE real shareOfBox(real range, real perLength) {
    const real share = (real) 1.000001*range*perLength+(real) 1e-6;
    return share < (real) 0.9 ? share : (real) 0.9;
}

/** Whether a pair is in range. */
DEVICE int interact(real r2, real range) {
    return r2 < range*range;
}

/**
 * Rows of neighbours: from the cells around each particle, or with SUM_IMAGES every image of every
 * pair in range.
 * @param radii       by place
 * @param groupRadii  the largest of each group
 * @param counts      neighbours kept, at most the length of the row
 * @param largest     per group of threads, the most neighbours for one entry of a row
 */
KERNEL void findSpheres(int n, int sizeGroups,
#ifdef SUM_IMAGES
        int numImages, GLOBAL const real4* RESTRICT images,
#else
        GLOBAL const int4* RESTRICT groupCells, GLOBAL const int* RESTRICT cellStart,
        GLOBAL const real* RESTRICT groupRadii,
#endif
        GLOBAL const int4* RESTRICT groupRows, GLOBAL const fraction4* RESTRICT places, GLOBAL const real* RESTRICT radii,
        GLOBAL const real* RESTRICT geometry, GLOBAL Neighbour* RESTRICT neighbours,
        GLOBAL int* RESTRICT counts, GLOBAL real* RESTRICT largest) {
    LOCAL real buffer[GROUP_SIZE];
    real most = 0;
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE) {
        const fraction4 own = places[i];
        const Row row = rowOf(i, sizeGroups, groupRows);
        const real ownRange = geometry[ENVELOPE]+radii[i];
        int found = 0;
#ifdef SUM_IMAGES
        for (int j = 0; j < n; j++) {
            const real4 d = displacement(own, places[j], geometry);
            for (int m = 0; m < numImages; m++) {
                const real4 image = images[m];
                const real4 r = make_real4(d.x+image.x, d.y+image.y, d.z+image.z, 0);
                if (interact(lengthSquared(r), ownRange+radii[j]) && (i != j || image.w != 0)) {
                    if (found < row.capacity)
                        neighbours[row.first+found*(mm_long) row.stride] = make_int2(j, m);
                    found++;
                }
            }
        }
#else
        const real x = fromFraction(own.x), y = fromFraction(own.y), z = fromFraction(own.z);
        for (int g = 0; g < sizeGroups; g++) {
            const int4 cells = groupCells[g];
            const real range = ownRange+groupRadii[g];
            const real reachX = shareOfBox(range, geometry[PER_LENGTH]), reachY = shareOfBox(range, geometry[PER_LENGTH+1]),
                    reachZ = shareOfBox(range, geometry[PER_LENGTH+2]);
            const int2 alongX = cellInterval(x-reachX, x+reachX, cells.x);
            const int2 alongY = cellInterval(y-reachY, y+reachY, cells.y);
            const int2 alongZ = cellInterval(z-reachZ, z+reachZ, cells.z);
            for (int column = 0; column < 2*alongX.y*alongY.y; column++) {
                const int cx = wrapped(alongX.x+column/(2*alongY.y), cells.x);
                const int cy = wrapped(alongY.x+column/2%alongY.y, cells.y);
                const int2 run = runOfPlaces(cellStart+cells.w+(cx*cells.y+cy)*cells.z, alongZ, cells.z, column%2);
                for (int j = run.x; j < run.y; j++)
                    if (interact(lengthSquared(displacement(own, places[j], geometry)), ownRange+radii[j]) && j != i) {
                        if (found < row.capacity)
                            neighbours[row.first+found*(mm_long) row.stride] = j;
                        found++;
                    }
            }
        }
#endif
        counts[i] = found < row.capacity ? found : row.capacity;
        most = larger(most, found/(real) row.capacity);
    }
    most = largestInGroup(buffer, most);
    if (LOCAL_ID == 0)
        largest[MOST_NEIGHBOURS*NUM_GROUPS+GROUP_ID] = most;
}

/** From neighbour k of a row to its particle. */
DEVICE real4 fromNeighbour(fraction4 own, Neighbour entry, GLOBAL const fraction4* RESTRICT places,
        IMAGES GLOBAL const real* RESTRICT geometry) {
    real4 d = displacement(own, places[NEIGHBOUR_PLACE(entry)], geometry);
#ifdef SUM_IMAGES
    const real4 image = images[entry.y];
    d.x += image.x;
    d.y += image.y;
    d.z += image.z;
#endif
    return d;
}

/** F and (G-F)/r^2 of two spheres apart, overlapping, or one inside the other [T24]. */
DEVICE real2 sphereScalars(real r2, real a, real b) {
    const real product = a*b, sum = a+b, difference = a-b, r = SQRT(r2);
    if (r > sum) {
        const real s = 1/r, squares = (a*a+b*b)*s*s;
        return make_real2(s*((real) 0.75+(real) 0.25*squares), s*s*s*((real) 0.75-(real) 0.75*squares));
    }
    if (r2 <= difference*difference || r2 < (real) SMALLEST_R2)
        return make_real2(1/(a > b ? a : b), 0);
    const real s = 1/r, past = difference*difference*s, skew = past+3*r, gap = past-r;
    return make_real2((16*sum-skew*skew*s)/(32*product), 3*gap*gap*s*s*s/(32*product));
}

/**
 * The wave part of a pair, from polynomials of degree TABLE_DEGREE for pairs of the BASIS radii.
 * @param tables   F, then C, of each pair, highest power first: [BASIS][BASIS], or with INTERPOLATED
 * one for each (p, q <= p)
 * @param weights  [kinds][BASIS], with INTERPOLATED
 */
DEVICE real2 waveScalars(real t, int kindA, int kindB, GLOBAL const int* RESTRICT plan,
        GLOBAL const real* RESTRICT tables
#ifdef INTERPOLATED
        , GLOBAL const real* RESTRICT weights
#endif
        ) {
    const int length = TABLE_DEGREE+1;
#ifdef INTERPOLATED
    GLOBAL const real* RESTRICT a = weights+kindA*(mm_long) BASIS;
    GLOBAL const real* RESTRICT b = weights+kindB*(mm_long) BASIS;
    GLOBAL const real* own = tables;
    real sumF = 0, sumC = 0;
// unrolled, it takes more registers than there are
#pragma unroll 1
    for (int p = 0; p < BASIS; p++)
        for (int q = 0; q <= p; q++) {
            const real weight = (p == q ? a[p]*b[p] : a[p]*b[q]+a[q]*b[p]);
#else
    GLOBAL const real* own = tables+(kindA*BASIS+kindB)*2*length;
#endif
            real F = own[0], C = own[length];
            for (int power = 1; power < length; power++) {
                F = F*t+own[power];
                C = C*t+own[length+power];
            }
#ifdef INTERPOLATED
            sumF += weight*F;
            sumC += weight*C;
            own += 2*length;
        }
    return make_real2(sumF, sumC);
#else
    return make_real2(F, C);
#endif
}

/** F and C of every pair in the rows. */
KERNEL void evaluatePairs(int n, int sizeGroups, GLOBAL const int* RESTRICT plan, GLOBAL const int4* RESTRICT groupRows,
        GLOBAL const fraction4* RESTRICT places, IMAGES GLOBAL const real* RESTRICT radii, GLOBAL const int* RESTRICT kinds,
        GLOBAL const Neighbour* RESTRICT neighbours, GLOBAL const int* RESTRICT counts,
        GLOBAL const real* RESTRICT geometry, GLOBAL const real* RESTRICT tables,
#ifdef INTERPOLATED
        GLOBAL const real* RESTRICT weights,
#endif
        GLOBAL real2* RESTRICT pairs) {
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE) {
        const fraction4 own = places[i];
        const Row row = rowOf(i, sizeGroups, groupRows);
        const int count = counts[i];
        for (int k = 0; k < count; k++) {
            const mm_long at = row.first+k*(mm_long) row.stride;
            const Neighbour entry = neighbours[at];
            const int j = NEIGHBOUR_PLACE(entry);
#ifdef SUM_IMAGES
            const real r2 = lengthSquared(fromNeighbour(own, entry, places, images, geometry));
#else
            const real r2 = lengthSquared(fromNeighbour(own, entry, places, geometry));
#endif
            const real2 whole = sphereScalars(r2, radii[i], radii[j]);
            const real2 wave = waveScalars(geometry[SCALE]*r2-1, kinds[i], kinds[j], plan, tables
#ifdef INTERPOLATED
                    , weights
#endif
                    );
            pairs[at] = make_real2(whole.x-wave.x, whole.y-wave.y);
        }
    }
}

/** Row i of M_R times v. */
DEVICE real4 rowProduct(int i, int sizeGroups, GLOBAL const int4* RESTRICT groupRows,
        GLOBAL const fraction4* RESTRICT places, IMAGES GLOBAL const int* RESTRICT kinds,
        GLOBAL const real* RESTRICT selves, GLOBAL const Neighbour* RESTRICT neighbours,
        GLOBAL const int* RESTRICT counts, GLOBAL const real2* RESTRICT pairs,
        GLOBAL const real* RESTRICT geometry, GLOBAL const real4* RESTRICT v) {
    const fraction4 own = places[i];
    const Row row = rowOf(i, sizeGroups, groupRows);
    const real4 mine = v[i];
    const real self = selves[kinds[i]];
    real x = self*mine.x, y = self*mine.y, z = self*mine.z;
    const int count = counts[i];
    for (int k = 0; k < count; k++) {
        const mm_long at = row.first+k*(mm_long) row.stride;
        const Neighbour entry = neighbours[at];
#ifdef SUM_IMAGES
        const real4 d = fromNeighbour(own, entry, places, images, geometry);
#else
        const real4 d = fromNeighbour(own, entry, places, geometry);
#endif
        const real4 w = v[NEIGHBOUR_PLACE(entry)];
        const real2 pair = pairs[at];
        const real along = pair.y*(d.x*w.x+d.y*w.y+d.z*w.z);
        x += pair.x*w.x+along*d.x;
        y += pair.x*w.y+along*d.y;
        z += pair.x*w.z+along*d.z;
    }
    return make_real4(x, y, z, 0);
}

#define MATRIX_PARAMETERS int n, int sizeGroups, GLOBAL const int4* RESTRICT groupRows, \
        GLOBAL const fraction4* RESTRICT places, IMAGES GLOBAL const int* RESTRICT kinds, \
        GLOBAL const real* RESTRICT selves, GLOBAL const Neighbour* RESTRICT neighbours, \
        GLOBAL const int* RESTRICT counts, GLOBAL const real2* RESTRICT pairs, GLOBAL const real* RESTRICT geometry
#ifdef SUM_IMAGES
#define ROW_PRODUCT(i, v) rowProduct(i, sizeGroups, groupRows, places, images, kinds, selves, neighbours, counts, pairs, geometry, v)
#else
#define ROW_PRODUCT(i, v) rowProduct(i, sizeGroups, groupRows, places, kinds, selves, neighbours, counts, pairs, geometry, v)
#endif
