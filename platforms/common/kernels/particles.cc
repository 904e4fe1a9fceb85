// SPDX-License-Identifier: MIT
// Between OpenMM's arrays, in its order of slots, and ours, in the order of places: particles sorted
// by cells of the box and, within a cell, by their index in the System. Places depend on positions
// alone, not on the order of slots, and with them every sum below.

// With SIZE_GROUPS the particles of each group, of like radii, have cells of their own: groupCells are
// those of each group, and the first of them.
#ifdef SIZE_GROUPS
#define FIRST_CELL cells.w+
#else
#define FIRST_CELL
#endif

/**
 * Where all particles are, and sorting keys of those that move.
 * @param rankOf   number of a particle among those that move, negative for one that does not
 * @param groupOf  by that number
 * @param inverseX, inverseYZ  the inverse of the box, a triangle: its first row; of the second y and
 * z, of the third z
 * @param restX, restYZ  in single precision: what floats have left of it
 */
KERNEL void locateParticles(int numAtoms,
#ifdef SIZE_GROUPS
        GLOBAL const int* RESTRICT groupOf, GLOBAL const int4* RESTRICT groupCells,
#else
        int4 cells,
#endif
        GLOBAL const real4* RESTRICT posq,
        GLOBAL const int* RESTRICT atomIndex, GLOBAL const int* RESTRICT rankOf,
        mixed4 inverseX, mixed4 inverseYZ, GLOBAL fraction4* RESTRICT located,
        GLOBAL mm_ulong* RESTRICT keys, GLOBAL int* RESTRICT slotOf
#ifdef USE_MIXED_PRECISION
        , GLOBAL const real4* RESTRICT posqCorrection
#elif !defined(USE_DOUBLE_PRECISION)
        , real4 restX, real4 restYZ
#endif
        ) {
    for (int slot = GLOBAL_ID; slot < numAtoms; slot += GLOBAL_SIZE) {
        const real4 p = posq[slot];
        mixed x = p.x, y = p.y, z = p.z;
        fraction4 s;
#if !defined(USE_DOUBLE_PRECISION) && !defined(USE_MIXED_PRECISION)
        s.x = fractionOfProduct(inverseX.x, restX.x, x)+fractionOfProduct(inverseX.y, restX.y, y)+
                fractionOfProduct(inverseX.z, restX.z, z);
        s.y = fractionOfProduct(inverseYZ.x, restYZ.x, y)+fractionOfProduct(inverseYZ.y, restYZ.y, z);
        s.z = fractionOfProduct(inverseYZ.z, restYZ.z, z);
#else
#ifdef USE_MIXED_PRECISION
        const real4 correction = posqCorrection[slot];
        x += correction.x;
        y += correction.y;
        z += correction.z;
#endif
        s.x = toFraction(inverseX.x*x+inverseX.y*y+inverseX.z*z);
        s.y = toFraction(inverseYZ.x*y+inverseYZ.y*z);
        s.z = toFraction(inverseYZ.z*z);
#endif
        const int particle = atomIndex[slot];
        s.w = particle;
        located[slot] = s;
        slotOf[particle] = slot;
        const int rank = rankOf[particle];
        if (rank >= 0) {
#ifdef SIZE_GROUPS
            const int4 cells = groupCells[groupOf[rank]];
#endif
            const int column = cellOf(s.x, cells.x)*cells.y+cellOf(s.y, cells.y);
            keys[rank+1] = ((mm_ulong) (FIRST_CELL column*cells.z+cellOf(s.z, cells.z)) << 32) | (unsigned int) particle;
        }
    }
    if (GLOBAL_ID == 0)
        keys[0] = 0; // see DevicePlaces
}

/**
 * From sorted keys, of which the first is nobody's, what is at each place.
 * @param largest  per group, whether keys are out of order
 */
KERNEL void placeParticles(int n, GLOBAL const mm_ulong* RESTRICT keys, GLOBAL const int* RESTRICT slotOf,
        GLOBAL const fraction4* RESTRICT located, GLOBAL fraction4* RESTRICT places, GLOBAL int* RESTRICT slotAt,
        GLOBAL real* RESTRICT largest) {
    LOCAL real buffer[GROUP_SIZE];
    real unsorted = 0;
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE) {
        const mm_ulong key = keys[place+1];
        const int slot = slotOf[(unsigned int) key];
        places[place] = located[slot];
        slotAt[place] = slot;
        if (key < keys[place])
            unsorted = 1;
    }
    unsorted = largestInGroup(buffer, unsorted);
    if (LOCAL_ID == 0)
        largest[UNSORTED*NUM_GROUPS+GROUP_ID] = unsorted;
}

#ifdef SIZE_GROUPS
/**
 * What kind of sphere is at each place, and its radius.
 * @param kindOf  by particle of the System
 */
KERNEL void placeSpheres(int n, GLOBAL const fraction4* RESTRICT places, GLOBAL const int* RESTRICT kindOf,
        GLOBAL const real* RESTRICT radii, GLOBAL int* RESTRICT kinds, GLOBAL real* RESTRICT radiusAt) {
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE) {
        const int kind = kindOf[places[place].w];
        kinds[place] = kind;
        radiusAt[place] = radii[kind];
    }
}
#endif

/** First place of every cell, and n after the last. */
KERNEL void findCells(int n, int numCells, GLOBAL const mm_ulong* RESTRICT keys, GLOBAL int* RESTRICT cellStart) {
    for (int cell = GLOBAL_ID; cell <= numCells; cell += GLOBAL_SIZE) {
        int low = 0, high = n;
        while (low < high) {
            const int middle = low+(high-low)/2;
            if ((keys[middle+1] >> 32) < (mm_ulong) cell)
                low = middle+1;
            else
                high = middle;
        }
        cellStart[cell] = low;
    }
}

/** Slots of the particles in their own order, where nothing needs to be sorted. */
KERNEL void findSlots(int numAtoms, GLOBAL const int* RESTRICT atomIndex, GLOBAL int* RESTRICT slotOf) {
    for (int slot = GLOBAL_ID; slot < numAtoms; slot += GLOBAL_SIZE)
        slotOf[atomIndex[slot]] = slot;
}

KERNEL void placeInOrder(int n, GLOBAL const int* RESTRICT particleAt, GLOBAL const int* RESTRICT slotOf,
        GLOBAL fraction4* RESTRICT places, GLOBAL int* RESTRICT slotAt) {
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE) {
        fraction4 s;
        s.x = s.y = s.z = 0;
        s.w = particleAt[place];
        places[place] = s;
        slotAt[place] = slotOf[particleAt[place]];
    }
}

/**
 * OpenMM's forces, fixed-point numbers in units of 2^-32 kJ/(mol nm), by place.
 * @param largest  per group, the largest component; those beyond 2^30 and what was not a number
 * count as 2^31
 */
KERNEL void takeForces(int n, int stride, GLOBAL const mm_long* RESTRICT forces,
        GLOBAL const int* RESTRICT slotAt, GLOBAL real4* RESTRICT f, GLOBAL real* RESTRICT largest) {
    LOCAL real buffer[GROUP_SIZE];
    const mm_long limit = (mm_long) 1 << 62;
    real most = 0;
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE) {
        const int slot = slotAt[place];
        const mm_long x = forces[slot], y = forces[slot+stride], z = forces[slot+2*stride];
        if (x > limit || -limit > x || y > limit || -limit > y || z > limit || -limit > z)
            most = (real) 2147483648.0;
        const real unit = (real) (1/4294967296.0);
        const real4 force = make_real4(unit*x, unit*y, unit*z, 0);
        f[place] = force;
        most = larger(most, largestOf(force));
    }
    most = largestInGroup(buffer, most);
    if (LOCAL_ID == 0)
        largest[LARGEST_FORCE*NUM_GROUPS+GROUP_ID] = most;
}

/** Forces given by particle, by place. */
KERNEL void takeGivenForces(int n, GLOBAL const fraction4* RESTRICT places, GLOBAL const real4* RESTRICT given,
        GLOBAL real4* RESTRICT f) {
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE)
        f[place] = given[places[place].w];
}

/** Largest component per group; not a number stays so. */
KERNEL void checkVelocities(int n, GLOBAL const real4* RESTRICT u, GLOBAL real* RESTRICT largest) {
    LOCAL real buffer[GROUP_SIZE];
    real most = 0;
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE)
        most = larger(most, largestOf(u[place]));
    most = largestInGroup(buffer, most);
    if (LOCAL_ID == 0)
        largest[LARGEST_VELOCITY*NUM_GROUPS+GROUP_ID] = most;
}

/**
 * Without hydrodynamics, u = mobility f + sqrt(mobility) noise z [T2].
 * @param mobility  by particle
 */
KERNEL void drainFreely(int n, int forced, real noise, int4 key, GLOBAL const fraction4* RESTRICT places,
        GLOBAL const real* RESTRICT mobility, GLOBAL const real4* RESTRICT f, GLOBAL real4* RESTRICT u) {
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE) {
        const unsigned int particle = (unsigned int) places[place].w;
        real4 velocity = make_real4(0, 0, 0, 0);
        if (forced) {
            const real4 force = f[place];
            velocity = make_real4(mobility[particle]*force.x, mobility[particle]*force.y, mobility[particle]*force.z, 0);
        }
        if (noise != 0) {
            const real amplitude = noise*SQRT(mobility[particle]);
            real z[3];
            particleNoise(key.x, key.y, key.z, key.w, particle, z);
            velocity.x += amplitude*z[0];
            velocity.y += amplitude*z[1];
            velocity.z += amplitude*z[2];
        }
        u[place] = velocity;
    }
}

/**
 * Advance positions by dt unit u; velocities become unit u.
 * @param unit  of u, in nm/ps
 */
KERNEL void moveParticles(int n, mixed dt, mixed unit, GLOBAL const int* RESTRICT slotAt,
        GLOBAL const real4* RESTRICT u, GLOBAL real4* RESTRICT posq, GLOBAL mixed4* RESTRICT velm
#ifdef USE_MIXED_PRECISION
        , GLOBAL real4* RESTRICT posqCorrection
#endif
        ) {
    for (int place = GLOBAL_ID; place < n; place += GLOBAL_SIZE) {
        const int slot = slotAt[place];
        const real4 own = u[place];
        mixed4 velocity = velm[slot];
        velocity.x = unit*own.x;
        velocity.y = unit*own.y;
        velocity.z = unit*own.z;
        velm[slot] = velocity;
        real4 p = posq[slot];
#ifdef USE_MIXED_PRECISION
        real4 rest = posqCorrection[slot];
        const mixed x = p.x+(mixed) rest.x+dt*velocity.x, y = p.y+(mixed) rest.y+dt*velocity.y,
                z = p.z+(mixed) rest.z+dt*velocity.z;
        p.x = (real) x;
        p.y = (real) y;
        p.z = (real) z;
        rest.x = (real) (x-p.x);
        rest.y = (real) (y-p.y);
        rest.z = (real) (z-p.z);
        posqCorrection[slot] = rest;
#else
        p.x += dt*velocity.x;
        p.y += dt*velocity.y;
        p.z += dt*velocity.z;
#endif
        posq[slot] = p;
    }
}

/**
 * After a step of dt: undisturbed flow carries particles by strain y, y that of the beginning of the
 * step [T35]. What does not move stays where the Context says it is, although its image tilts with
 * the box.
 * @param shifts  by slot, from the particle to the image that OpenMM keeps (nm)
 */
KERNEL void carryAlong(int numAtoms, mixed strain, mixed dt, GLOBAL const mixed4* RESTRICT shifts,
        GLOBAL real4* RESTRICT posq, GLOBAL mixed4* RESTRICT velm
#ifdef USE_MIXED_PRECISION
        , GLOBAL real4* RESTRICT posqCorrection
#endif
        ) {
    for (int slot = GLOBAL_ID; slot < numAtoms; slot += GLOBAL_SIZE) {
        real4 p = posq[slot];
        mixed x = p.x, y = p.y;
#ifdef USE_MIXED_PRECISION
        real4 rest = posqCorrection[slot];
        x += rest.x;
        y += rest.y;
#endif
        mixed4 velocity = velm[slot];
        mixed height = shifts[slot].y;
        if (velocity.w != 0) { // it has a mass
            const mixed before = y-dt*velocity.y;
            velocity.x += strain/dt*(before-height);
            velm[slot] = velocity;
            height = before;
        }
        x += strain*height;
        p.x = (real) x;
#ifdef USE_MIXED_PRECISION
        rest.x = (real) (x-p.x);
        posqCorrection[slot] = rest;
#endif
        posq[slot] = p;
    }
}

/** Numbers that the host changes between launches without waiting for the device. */
KERNEL void setNumbers(GLOBAL real4* RESTRICT numbers, real4 a, real4 b, real4 c, real4 d) {
    if (GLOBAL_ID == 0) {
        numbers[0] = a;
        numbers[1] = b;
        numbers[2] = c;
        numbers[3] = d;
    }
}

/**
 * What the host reads once in a step.
 * @param largest  [MAXIMA][groups]
 * @param partial  [sums][groups]
 * @param summary  [MAXIMA+sums]
 */
KERNEL void summarise(int sums, int groups, GLOBAL const real* RESTRICT largest,
        GLOBAL const mixed* RESTRICT partial, GLOBAL mixed* RESTRICT summary) {
    LOCAL real maximaBuffer[GROUP_SIZE];
    LOCAL mixed sumsBuffer[GROUP_SIZE];
    for (int row = GROUP_ID; row < MAXIMA+sums; row += NUM_GROUPS) {
        if (row < MAXIMA) {
            real most = 0;
            for (int i = LOCAL_ID; i < groups; i += GROUP_SIZE)
                most = larger(most, largest[row*groups+i]);
            most = largestInGroup(maximaBuffer, most);
            if (LOCAL_ID == 0)
                summary[row] = most;
        }
        else {
            const mixed sum = sumOfGroups(sumsBuffer, partial+(row-MAXIMA)*groups, groups);
            if (LOCAL_ID == 0)
                summary[row] = sum;
        }
    }
}
