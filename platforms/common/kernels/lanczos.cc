// SPDX-License-Identifier: MIT
// The Lanczos process for a square root [T18]. What precedes this text says whose: it defines
// MATRIX_PARAMETERS, n among them, and ROW_PRODUCT(i, v), row i of M times v.

// The Lanczos process leaves its basis vectors v_i unnormalised, basis[i][n]; `partial` holds one
// row of sums over groups for each |v_i|^2 (row 2i) and each v_i . M v_i (row 2i+1).

// With MIXTURE it is the square root of X = D^{-1/2} M D^{-1/2} [T55]. What is kept of its vectors is
// y = D^{-1/2} v, with D as the fourth number: X v is D^{-1} M y then, and v . w is D y . z.
#ifdef MIXTURE
#define WEIGHT(y) (y).w
#else
#define WEIGHT(y) 1
#endif

/** Basis vector 0: normal numbers of the particles. */
KERNEL void drawNoise(int n, int4 key, GLOBAL const fraction4* RESTRICT places, GLOBAL real4* RESTRICT basis,
        GLOBAL mixed* RESTRICT partial
#ifdef MIXTURE
        , GLOBAL const int* RESTRICT kinds, GLOBAL const real* RESTRICT scales
#endif
        ) {
    LOCAL mixed buffer[GROUP_SIZE];
    mixed square = 0;
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE) {
        real z[3];
        particleNoise(key.x, key.y, key.z, key.w, (unsigned int) places[i].w, z);
#ifdef MIXTURE
        const real scale = scales[kinds[i]];
        const real4 own = make_real4(z[0], z[1], z[2], 0);
        basis[i] = make_real4(z[0]/scale, z[1]/scale, z[2]/scale, scale*scale);
#else
        const real4 own = make_real4(z[0], z[1], z[2], 0);
        basis[i] = own;
#endif
        square += dotProduct(own, own);
    }
    square = sumInGroup(buffer, square);
    if (LOCAL_ID == 0)
        partial[GROUP_ID] = square;
}

/** v_{i+1} = M v_i/|v_i| - v_{i-1} |v_i|/|v_{i-1}|, and v_i . v_{i+1} */
KERNEL void expandBasis(MATRIX_PARAMETERS, int iteration, GLOBAL real4* RESTRICT basis, GLOBAL mixed* RESTRICT partial) {
    LOCAL mixed buffer[GROUP_SIZE];
    const int groups = NUM_GROUPS;
    const mixed square = sumOfGroups(buffer, partial+2*iteration*groups, groups);
    const mixed before = iteration > 0 ? sumOfGroups(buffer, partial+2*(iteration-1)*groups, groups) : 0;
    // an exhausted space goes on with zeros
    const real s = square > 0 ? (real) (1/sqrt(square)) : 0, t = before > 0 ? (real) sqrt(square/before) : 0;
    GLOBAL const real4* current = basis+iteration*(mm_long) n;
    mixed overlap = 0;
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE) {
        real4 next = ROW_PRODUCT(i, current);
        const real4 last = iteration > 0 ? basis[(iteration-1)*(mm_long) n+i] : make_real4(0, 0, 0, 0);
#ifdef MIXTURE
        const real weight = current[i].w, own = s/weight;
        next.w = weight;
#else
        const real own = s;
#endif
        next.x = own*next.x-t*last.x;
        next.y = own*next.y-t*last.y;
        next.z = own*next.z-t*last.z;
        basis[(iteration+1)*(mm_long) n+i] = next;
        overlap += WEIGHT(next)*dotProduct(current[i], next);
    }
    overlap = sumInGroup(buffer, overlap);
    if (LOCAL_ID == 0)
        partial[(2*iteration+1)*groups+GROUP_ID] = overlap;
}

/** v_{i+1} -= v_i (v_i . v_{i+1})/|v_i|^2, and |v_{i+1}|^2 */
KERNEL void makeOrthogonal(int n, int iteration, GLOBAL real4* RESTRICT basis, GLOBAL mixed* RESTRICT partial) {
    LOCAL mixed buffer[GROUP_SIZE];
    const int groups = NUM_GROUPS;
    const mixed square = sumOfGroups(buffer, partial+2*iteration*groups, groups);
    const mixed overlap = sumOfGroups(buffer, partial+(2*iteration+1)*groups, groups);
    const real c = square > 0 ? (real) (overlap/square) : 0;
    mixed newSquare = 0;
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE) {
        const real4 last = basis[iteration*(mm_long) n+i];
        real4 next = basis[(iteration+1)*(mm_long) n+i];
        next.x -= c*last.x;
        next.y -= c*last.y;
        next.z -= c*last.z;
        basis[(iteration+1)*(mm_long) n+i] = next;
        newSquare += WEIGHT(next)*dotProduct(next, next);
    }
    newSquare = sumInGroup(buffer, newSquare);
    if (LOCAL_ID == 0)
        partial[2*(iteration+1)*groups+GROUP_ID] = newSquare;
}

// In double precision every new vector is then made orthogonal to all before it once more: rounding,
// which lets it lean towards them, else costs iterations, and in the end convergence.

/** v_j . v_{i+1} of all j <= i, per group: overlaps[j][groups] */
KERNEL void findOverlaps(int n, int iteration, GLOBAL const real4* RESTRICT basis, GLOBAL mixed* RESTRICT overlaps) {
    LOCAL mixed buffer[GROUP_SIZE];
    for (int j = 0; j <= iteration; j++) {
        mixed overlap = 0;
        for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE)
            overlap += WEIGHT(basis[i])*dotProduct(basis[j*(mm_long) n+i], basis[(iteration+1)*(mm_long) n+i]);
        overlap = sumInGroup(buffer, overlap);
        if (LOCAL_ID == 0)
            overlaps[j*NUM_GROUPS+GROUP_ID] = overlap;
    }
}

/** v_{i+1} -= sum over j <= i of v_j (v_j . v_{i+1})/|v_j|^2, and |v_{i+1}|^2 */
KERNEL void removeOverlaps(int n, int iteration, GLOBAL real4* RESTRICT basis,
        GLOBAL const mixed* RESTRICT overlaps, GLOBAL mixed* RESTRICT partial) {
    LOCAL mixed buffer[GROUP_SIZE];
    LOCAL real factors[MOST_VECTORS];
    const int groups = NUM_GROUPS;
    for (int j = 0; j <= iteration; j++) {
        const mixed square = sumOfGroups(buffer, partial+2*j*groups, groups);
        const mixed overlap = sumOfGroups(buffer, overlaps+j*groups, groups);
        if (LOCAL_ID == 0)
            factors[j] = square > 0 ? (real) (overlap/square) : 0;
    }
    SYNC_THREADS;
    mixed newSquare = 0;
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE) {
        real4 next = basis[(iteration+1)*(mm_long) n+i];
        for (int j = iteration; j >= 0; j--) {
            const real4 v = basis[j*(mm_long) n+i];
            next.x -= factors[j]*v.x;
            next.y -= factors[j]*v.y;
            next.z -= factors[j]*v.z;
        }
        basis[(iteration+1)*(mm_long) n+i] = next;
        newSquare += WEIGHT(next)*dotProduct(next, next);
    }
    newSquare = sumInGroup(buffer, newSquare);
    if (LOCAL_ID == 0)
        partial[2*(iteration+1)*groups+GROUP_ID] = newSquare;
}

/** u += sum over k of coefficients[k] v_k, with MIXTURE D^{1/2} v_k */
KERNEL void combineBasis(int n, int count, GLOBAL const real4* RESTRICT basis,
        GLOBAL const real* RESTRICT coefficients, GLOBAL real4* RESTRICT u) {
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE) {
        real4 sum = u[i];
        for (int k = 0; k < count; k++) {
            const real4 v = basis[k*(mm_long) n+i];
            const real c = WEIGHT(v)*coefficients[k];
            sum.x += c*v.x;
            sum.y += c*v.y;
            sum.z += c*v.z;
        }
        u[i] = sum;
    }
}
