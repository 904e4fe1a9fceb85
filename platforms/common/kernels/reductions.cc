// SPDX-License-Identifier: MIT
// Sums and maxima over a work group and over the groups of a launch, in an order that depends on
// the size of the launch alone. GROUP_SIZE is a power of two.

// rows of the array `largest`, one real for each group
#define LARGEST_FORCE 0
#define LARGEST_VELOCITY 1
#define MOST_NEIGHBOURS 2
#define UNSORTED 3
#define MAXIMA 4

/** The larger of two numbers; not a number if one of them is not. */
DEVICE real larger(real a, real b) {
    return (b > a || b != b) ? b : a;
}

DEVICE real largestOf(real4 v) {
    return larger(larger(FABS(v.x), FABS(v.y)), FABS(v.z));
}

/** To be called by all threads of a group. */
DEVICE real largestInGroup(LOCAL_ARG real* buffer, real value) {
    SYNC_THREADS;
    buffer[LOCAL_ID] = value;
    SYNC_THREADS;
    for (int stride = GROUP_SIZE/2; stride > 0; stride /= 2) {
        if (LOCAL_ID < stride)
            buffer[LOCAL_ID] = larger(buffer[LOCAL_ID], buffer[LOCAL_ID+stride]);
        SYNC_THREADS;
    }
    return buffer[0];
}

/** To be called by all threads of a group. */
DEVICE mixed sumInGroup(LOCAL_ARG mixed* buffer, mixed value) {
    SYNC_THREADS;
    buffer[LOCAL_ID] = value;
    SYNC_THREADS;
    for (int stride = GROUP_SIZE/2; stride > 0; stride /= 2) {
        if (LOCAL_ID < stride)
            buffer[LOCAL_ID] += buffer[LOCAL_ID+stride];
        SYNC_THREADS;
    }
    return buffer[0];
}

/** The sum of one number from each group. To be called by all threads of a group. */
DEVICE mixed sumOfGroups(LOCAL_ARG mixed* buffer, GLOBAL const mixed* RESTRICT partial, int groups) {
    mixed sum = 0;
    for (int i = LOCAL_ID; i < groups; i += GROUP_SIZE)
        sum += partial[i];
    return sumInGroup(buffer, sum);
}

DEVICE mixed dotProduct(real4 v, real4 w) {
    return v.x*(mixed) w.x+v.y*(mixed) w.y+v.z*(mixed) w.z;
}
