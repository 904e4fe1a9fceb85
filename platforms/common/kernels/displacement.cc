// SPDX-License-Identifier: MIT
// From one particle to another, by the differences of their fractions.

// places in the array of geometry, lengths in radii; what else it holds is the rows' own
#define BOX 0    // x of a, b; y of b; x, y, z of c, per unit of fractions
#define WHOLE 6  // x of a, b; y of b

/** From b to a: the nearest image, or with SUM_IMAGES the one of wrapped fractions. */
DEVICE real4 displacement(fraction4 a, fraction4 b, GLOBAL const real* RESTRICT geometry) {
    const real sx = (real) (signedFraction) (a.x-b.x), sy = (real) (signedFraction) (a.y-b.y),
            sz = (real) (signedFraction) (a.z-b.z);
    GLOBAL const real* RESTRICT box = geometry+BOX;
    real4 d = make_real4(box[0]*sx+box[1]*sy+box[3]*sz, box[2]*sy+box[4]*sz, box[5]*sz, 0);
#if defined(TILTED) && !defined(SUM_IMAGES)
    // the nearest fractions are not always the nearest image there
    GLOBAL const real* RESTRICT whole = geometry+WHOLE;
    const real nb = floor(d.y/whole[2]+(real) 0.5);
    d.y -= nb*whole[2];
    d.x -= nb*whole[1];
    d.x -= floor(d.x/whole[0]+(real) 0.5)*whole[0];
#endif
    return d;
}

DEVICE real lengthSquared(real4 d) {
    return d.x*d.x+d.y*d.y+d.z*d.z;
}
