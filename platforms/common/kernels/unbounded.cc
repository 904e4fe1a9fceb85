// SPDX-License-Identifier: MIT
// An unbounded fluid: M = F (I - rr) + G rr as F I + C d d^T, summed over all pairs [T32]; what
// follows, lanczos.cc, draws its square root. Lengths in the smallest radius a, mobilities in
// 1/(6 pi eta a). A thread owns a row and adds all columns in their order: threads of a group read
// the same one at the same time, and no sum is shared between them.

/**
 * Positions by place, in nm as the Context has them, not the images that OpenMM keeps: of two floats in mixed precision,
 * whose differences err by rounding of themselves alone.
 * @param centres  radius over a in the fourth component
 * @param radius   over a, by particle
 * @param shifts   by slot, from the particle to its image
 */
KERNEL void locateCentres(int n, GLOBAL const real4* RESTRICT posq, GLOBAL const int* RESTRICT slotAt,
        GLOBAL const fraction4* RESTRICT places, GLOBAL const real* RESTRICT radius,
        GLOBAL const mixed4* RESTRICT shifts, GLOBAL real4* RESTRICT centres
#ifdef USE_MIXED_PRECISION
        , GLOBAL const real4* RESTRICT posqCorrection, GLOBAL real4* RESTRICT rests
#endif
        ) {
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE) {
        const int slot = slotAt[place];
        const real4 p = posq[slot];
        const mixed4 shift = shifts[slot];
        mixed x = p.x, y = p.y, z = p.z;
#ifdef USE_MIXED_PRECISION
        const real4 rest = posqCorrection[slot];
        x += rest.x;
        y += rest.y;
        z += rest.z;
#endif
        x -= shift.x;
        y -= shift.y;
        z -= shift.z;
        const real4 centre = make_real4((real) x, (real) y, (real) z, radius[(unsigned int) places[place].w]);
        centres[place] = centre;
#ifdef USE_MIXED_PRECISION
        rests[place] = make_real4((real) (x-centre.x), (real) (y-centre.y), (real) (z-centre.z), 0);
#endif
    }
}

/** F and C of a pair of spheres whose radii are ai and aj [T3, T24], or of their envelopes [T53]. */
DEVICE real2 pairScalars(real r2, real ai, real aj) {
#ifdef GAUSSIAN_F
    const real squares = ai*ai+aj*aj, s = RSQRT(squares+(real) SPREAD*r2), t = 2*squares*s*s-1;
    return make_real2(s*GAUSSIAN_F, s*s*s*GAUSSIAN_C);
#else
    // C d d^T vanishes where 1/r^2 could overflow
    r2 = r2 < (real) SMALLEST_R2 ? (real) SMALLEST_R2 : r2;
    const real s = RSQRT(r2), s2 = s*s;
#ifdef EQUAL_RADII
    if (r2 < (real) (CONTACT*CONTACT))
        return make_real2(1+(real) OVERLAP_F1*r2*s, (real) (OVERLAP_G1-OVERLAP_F1)*s);
    return make_real2(s*((real) APART_F1+(real) APART_F3*s2),
            s*s2*((real) (APART_G1-APART_F1)+(real) (APART_G3-APART_F3)*s2));
#else
    const real sum = ai+aj, difference2 = (ai-aj)*(ai-aj), squares = (real) 0.25*(ai*ai+aj*aj)*s2;
    if (r2 > sum*sum)
        return make_real2(s*((real) 0.75+squares), s*s2*((real) 0.75-3*squares));
    if (r2 <= difference2)
        return make_real2(1/(ai > aj ? ai : aj), 0);
    const real inverse = 1/(ai*aj), scale = s*s2*(real) (1.0/32), skew = difference2+3*r2, gap = difference2-r2;
    return make_real2(inverse*((real) 0.5*sum-skew*skew*scale), 3*inverse*(s2*gap)*(scale*gap));
#endif
#endif
}

#ifdef USE_MIXED_PRECISION
#define MATRIX_PARAMETERS int n, real perRadius, GLOBAL const real4* RESTRICT centres, GLOBAL const real4* RESTRICT rests
#define ROW_PRODUCT(i, v) rowProduct(i, n, perRadius, centres, rests, v)
#else
#define MATRIX_PARAMETERS int n, real perRadius, GLOBAL const real4* RESTRICT centres
#define ROW_PRODUCT(i, v) rowProduct(i, n, perRadius, centres, v)
#endif

/** Row i of M times v. */
DEVICE real4 rowProduct(int i, MATRIX_PARAMETERS, GLOBAL const real4* RESTRICT v) {
    const real4 own = centres[i];
#ifdef USE_MIXED_PRECISION
    const real4 ownRest = rests[i];
#endif
    real4 u = make_real4(0, 0, 0, 0);
    for (int j = 0; j < n; j++) {
        const real4 other = centres[j], w = v[j];
        real dx = own.x-other.x, dy = own.y-other.y, dz = own.z-other.z;
#ifdef USE_MIXED_PRECISION
        const real4 rest = rests[j];
        dx += ownRest.x-rest.x;
        dy += ownRest.y-rest.y;
        dz += ownRest.z-rest.z;
#endif
        dx *= perRadius;
        dy *= perRadius;
        dz *= perRadius;
        real2 pair = pairScalars(dx*dx+dy*dy+dz*dz, own.w, other.w);
        if (j == i)
            pair = make_real2(1/own.w, 0);
        const real along = pair.y*(dx*w.x+dy*w.y+dz*w.z);
        u.x += pair.x*w.x+along*dx;
        u.y += pair.x*w.y+along*dy;
        u.z += pair.x*w.z+along*dz;
    }
    return u;
}

/** u = M f */
KERNEL void multiplyAll(MATRIX_PARAMETERS, GLOBAL const real4* RESTRICT f, GLOBAL real4* RESTRICT u) {
    for (int i = GLOBAL_ID; i < n; i += GLOBAL_SIZE)
        u[i] = ROW_PRODUCT(i, f);
}
