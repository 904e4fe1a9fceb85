// SPDX-License-Identifier: MIT
// Unequal spheres between particles and the grid [T30, T31], in place of the windows of waveSpace.cc,
// whose blocks of grid points these kernels share. A weight is a polynomial in t = scale r^2 + shift,
// for `least` < t < 1, and zero elsewhere; it is evaluated where it is used. SPHERE_DEGREE is a
// number, or an entry of `plan` (PlanConstants).

// places in the array `metric`: numerics/GridMetric.h
#define PLANE 0
#define LINE 1
#define POINT 2
#define SKEW_Y 3
#define SKEW_X 4
#define SKEW_Z 5
#define PER_LENGTH 6 // three numbers

// fields of a shape
#define SCALE_OF(shape) (shape).x
#define SHIFT_OF(shape) (shape).y
#define LEAST_OF(shape) (shape).z // below -1 unless the kernel is hollow
#define REACH_OF(shape) (shape).w
#define HOLLOW(shape) (LEAST_OF(shape) > (real) -1.5)

#define SPHERE_LANES 32 // threads that gather for one sphere
#define LANES_Z 8       // of them along z

/** The point of the grid below a fraction, in [0, count), and how far above it that is. */
DEVICE int pointBelow(fraction own, int count, real* above) {
    const mm_ulong unit = (mm_ulong) 1 << GRID_BITS;
    const mm_ulong u = (mm_ulong) (own >> (FRACTION_BITS-GRID_BITS))*(unsigned int) count;
    *above = (real) (u & (unit-1))/(real) unit;
    return (int) (u >> GRID_BITS);
}

/** a/b rounded down, b > 0 */
DEVICE int floorQuotient(int a, int b) {
    return a >= 0 ? a/b : -((b-1-a)/b);
}

/** The part of r^2 that a line along z shares, offsets in grid points. */
DEVICE real squareOfLine(real x, real y, GLOBAL const real* RESTRICT metric) {
    const real along = y-metric[SKEW_Y]*x;
    return metric[PLANE]*x*x+metric[LINE]*along*along;
}

/** Where on a line along z that square is r^2 itself. */
DEVICE real middleOfLine(real x, real y, GLOBAL const real* RESTRICT metric) {
    return metric[SKEW_X]*x+metric[SKEW_Z]*y;
}

DEVICE real distanceOf(real x, real y, real z, GLOBAL const real* RESTRICT metric) {
    const real along = z-middleOfLine(x, y, metric);
    return SQRT(squareOfLine(x, y, metric)+metric[POINT]*along*along);
}

/** Half of the longest diagonal of a tile. */
DEVICE real radiusOfTile(GLOBAL const real* RESTRICT metric) {
    const real x = (real) 0.5*(TILE_X-1), y = (real) 0.5*(BLOCK_Y-1), z = (real) 0.5*(PART-1);
    return larger(larger(distanceOf(x, y, z, metric), distanceOf(x, y, -z, metric)),
            larger(distanceOf(x, -y, z, metric), distanceOf(x, -y, -z, metric)));
}

/** Whether [from, from+length] overlaps [-reach, reach]. */
DEVICE int overlaps(real from, real length, real reach) {
    return from <= reach && from+length >= -reach;
}

/**
 * Bit TILES_X*part+t is set if a sphere may touch tile t of that part of a block.
 * @param corner  of the block, from the sphere, in grid points
 */
DEVICE int tilesOfSphere(real4 corner, real4 shape, real tileRadius, GLOBAL const real* RESTRICT metric) {
    const real reach = REACH_OF(shape), x = reach*metric[PER_LENGTH], y = reach*metric[PER_LENGTH+1],
            z = reach*metric[PER_LENGTH+2];
    if (!overlaps(corner.x, BLOCK_X-1, x) || !overlaps(corner.y, BLOCK_Y-1, y) || !overlaps(corner.z, BLOCK_Z-1, z))
        return 0;
    const real inner = HOLLOW(shape) ? SQRT((-1-SHIFT_OF(shape))/SCALE_OF(shape)) : 0;
    int tiles = 0;
    for (int tile = 0; tile < TILES; tile++) {
        const real ownX = corner.x+tile%TILES_X*TILE_X, ownZ = corner.z+tile/TILES_X*PART;
        const real r = distanceOf(ownX+(real) 0.5*(TILE_X-1), corner.y+(real) 0.5*(BLOCK_Y-1),
                ownZ+(real) 0.5*(PART-1), metric);
        if (overlaps(ownX, TILE_X-1, x) && overlaps(ownZ, PART-1, z) && r < reach+tileRadius && r+tileRadius > inner)
            tiles |= 1 << tile;
    }
    return tiles;
}

/**
 * Cells [first, first+number) whose particles may touch grid points [from, from+block) of an axis;
 * those outside [0, cells) stand for images.
 * @param reach  of the particles, in grid points
 */
DEVICE int2 cellsInReach(int from, int block, int count, int cells, real reach) {
    const int to = (from+block < count ? from+block : count)-1;
    const real margin = (real) 1e-5;
    const int first = (int) floor(((from-reach)/count-margin)*cells);
    return make_int2(first, (int) floor(((to+reach)/count+margin)*cells)-first+1);
}

/**
 * A batch of spheres for a block.
 * @param corner   of the block, in the image of the box in which the spheres are, in grid points
 * @param corners  from the spheres to it
 */
DEVICE void stageSpheres(int first, int count, int4 corner, int4 size, real tileRadius,
        GLOBAL const fraction4* RESTRICT places, GLOBAL const int* RESTRICT kinds, GLOBAL const real4* RESTRICT shapes,
        GLOBAL const real* RESTRICT metric, GLOBAL const real4* RESTRICT f, LOCAL_ARG real4* corners,
        LOCAL_ARG real4* ownShapes, LOCAL_ARG real4* forces, LOCAL_ARG int* ownKinds, LOCAL_ARG int* tiles) {
    for (int i = LOCAL_ID; i < count; i += GROUP_SIZE) {
        const fraction4 s = places[first+i];
        const int kind = kinds[first+i];
        real x, y, z;
        const int belowX = pointBelow(s.x, size.x, &x), belowY = pointBelow(s.y, size.y, &y),
                belowZ = pointBelow(s.z, size.z, &z);
        const real4 own = make_real4((corner.x-belowX)-x, (corner.y-belowY)-y, (corner.z-belowZ)-z, 0);
        const real4 shape = shapes[kind];
        corners[i] = own;
        ownShapes[i] = shape;
        ownKinds[i] = kind;
        forces[i] = f[first+i];
        tiles[i] = tilesOfSphere(own, shape, tileRadius, metric);
    }
}

/**
 * Forces on the grid.
 * @param groupCells    cells of each group of particles of like size, and the first of them
 * @param reaches       of the largest sphere of each group
 * @param kinds         by place, index of its shape
 * @param shapes        [kinds], see above
 * @param coefficients  [kinds][SPHERE_DEGREE+1], highest power first
 */
KERNEL void spreadSpheres(int4 size, int groups, GLOBAL const int* RESTRICT plan, GLOBAL const int4* RESTRICT groupCells,
        GLOBAL const real* RESTRICT reaches, GLOBAL const int* RESTRICT cellStart,
        GLOBAL const fraction4* RESTRICT places, GLOBAL const int* RESTRICT kinds, GLOBAL const real4* RESTRICT shapes,
        GLOBAL const real* RESTRICT coefficients, GLOBAL const real* RESTRICT metric, GLOBAL const real4* RESTRICT f,
        GLOBAL real* RESTRICT gridX, GLOBAL real* RESTRICT gridY, GLOBAL real* RESTRICT gridZ) {
    LOCAL real buffer[COLUMNS*BLOCK_Z];
    LOCAL real4 corners[BATCH], ownShapes[BATCH], forces[BATCH];
    LOCAL int ownKinds[BATCH], tiles[BATCH];
    LOCAL unsigned int words[TILES*WORDS];
    const int blocksY = (size.y+BLOCK_Y-1)/BLOCK_Y, blocksZ = (size.z+BLOCK_Z-1)/BLOCK_Z;
    const int blocks = (size.x+BLOCK_X-1)/BLOCK_X*blocksY*blocksZ;
    const int column = LOCAL_ID%COLUMNS, part = LOCAL_ID/COLUMNS;
    const int tile = part*TILES_X+column/(TILE_X*BLOCK_Y);
    const real tileRadius = radiusOfTile(metric);
    for (int block = GROUP_ID; block < blocks; block += NUM_GROUPS) {
        const int4 corner = make_int4(block/(blocksY*blocksZ)*BLOCK_X, block/blocksZ%blocksY*BLOCK_Y,
                block%blocksZ*BLOCK_Z, 0);
        real sumX[PART], sumY[PART], sumZ[PART];
        for (int k = 0; k < PART; k++)
            sumX[k] = sumY[k] = sumZ[k] = 0;
        for (int g = 0; g < groups; g++) {
            const int4 cells = groupCells[g];
            const real reach = reaches[g];
            const int2 alongX = cellsInReach(corner.x, BLOCK_X, size.x, cells.x, reach*metric[PER_LENGTH]);
            const int2 alongY = cellsInReach(corner.y, BLOCK_Y, size.y, cells.y, reach*metric[PER_LENGTH+1]);
            const int2 alongZ = cellsInReach(corner.z, BLOCK_Z, size.z, cells.z, reach*metric[PER_LENGTH+2]);
            const int end = alongZ.x+alongZ.y;
            for (int c = 0; c < alongX.y*alongY.y; c++) {
                const int cx = alongX.x+c/alongY.y, cy = alongY.x+c%alongY.y;
                const int imageX = floorQuotient(cx, cells.x), imageY = floorQuotient(cy, cells.y);
                GLOBAL const int* start = cellStart+cells.w
                        +((cx-imageX*cells.x)*cells.y+cy-imageY*cells.y)*cells.z;
                for (int cz = alongZ.x; cz < end; ) {
                    const int imageZ = floorQuotient(cz, cells.z), base = imageZ*cells.z;
                    const int next = base+cells.z < end ? base+cells.z : end;
                    const int runEnd = start[next-base];
                    const int4 own = make_int4(corner.x-imageX*size.x, corner.y-imageY*size.y, corner.z-imageZ*size.z, 0);
                    for (int first = start[cz-base]; first < runEnd; first += BATCH) {
                        const int count = runEnd-first < BATCH ? runEnd-first : BATCH;
                        SYNC_THREADS;
                        stageSpheres(first, count, own, size, tileRadius, places, kinds, shapes, metric, f, corners,
                                ownShapes, forces, ownKinds, tiles);
                        SYNC_THREADS;
                        collectBits(count, tiles, words);
                        SYNC_THREADS;
                        for (int k = 0; k < WORDS; k++)
                            for (unsigned int left = words[tile*WORDS+k]; left != 0; left &= left-1) {
                                const int i = 32*k+31-LEADING_ZEROS(left & (~left+1)); // its lowest bit
                                const real4 shape = ownShapes[i], from = corners[i];
                                const real x = from.x+column/BLOCK_Y, y = from.y+column%BLOCK_Y;
                                const real nearest = SCALE_OF(shape)*squareOfLine(x, y, metric)+SHIFT_OF(shape);
                                if (nearest >= 1)
                                    continue;
                                const real z = from.z+part*PART-middleOfLine(x, y, metric);
                                const real slope = SCALE_OF(shape)*metric[POINT];
                                GLOBAL const real* RESTRICT powers = coefficients+ownKinds[i]*(SPHERE_DEGREE+1);
                                real t[PART], w[PART];
                                for (int p = 0; p < PART; p++) {
                                    t[p] = nearest+slope*(z+p)*(z+p);
                                    w[p] = powers[0];
                                }
                                for (int power = 1; power <= SPHERE_DEGREE; power++)
                                    for (int p = 0; p < PART; p++)
                                        w[p] = w[p]*t[p]+powers[power];
                                const real4 force = forces[i];
                                for (int p = 0; p < PART; p++) {
                                    const real weight = t[p] < 1 && t[p] > LEAST_OF(shape) ? w[p] : 0;
                                    sumX[p] += weight*force.x;
                                    sumY[p] += weight*force.y;
                                    sumZ[p] += weight*force.z;
                                }
                            }
                    }
                    cz = next;
                }
            }
        }
        storeBlock(sumX, corner, size, buffer, gridX);
        storeBlock(sumY, corner, size, buffer, gridY);
        storeBlock(sumZ, corner, size, buffer, gridZ);
        SYNC_THREADS;
    }
}

/** u += what the grids hold at the spheres: the transpose of spreading; SPHERE_LANES threads for each. */
KERNEL void gatherSpheres(int n, int4 size, GLOBAL const int* RESTRICT plan, GLOBAL const fraction4* RESTRICT places,
        GLOBAL const int* RESTRICT kinds, GLOBAL const real4* RESTRICT shapes, GLOBAL const real* RESTRICT coefficients,
        GLOBAL const real* RESTRICT metric, GLOBAL const real* RESTRICT gridX, GLOBAL const real* RESTRICT gridY,
        GLOBAL const real* RESTRICT gridZ, GLOBAL real4* RESTRICT u) {
    LOCAL real sums[3*GROUP_SIZE];
    const int lane = LOCAL_ID%SPHERE_LANES, perGroup = GROUP_SIZE/SPHERE_LANES;
    for (int first = GROUP_ID*perGroup; first < n; first += NUM_GROUPS*perGroup) {
        const int place = first+LOCAL_ID/SPHERE_LANES;
        real sumX = 0, sumY = 0, sumZ = 0;
        if (place < n) {
            const fraction4 s = places[place];
            const int kind = kinds[place];
            const real4 shape = shapes[kind];
            const real reach = REACH_OF(shape), reachX = reach*metric[PER_LENGTH], reachY = reach*metric[PER_LENGTH+1],
                    reachZ = reach*metric[PER_LENGTH+2], slope = SCALE_OF(shape)*metric[POINT];
            GLOBAL const real* RESTRICT powers = coefficients+kind*(SPHERE_DEGREE+1);
            real aboveX, aboveY, aboveZ;
            const int belowX = pointBelow(s.x, size.x, &aboveX), belowY = pointBelow(s.y, size.y, &aboveY),
                    belowZ = pointBelow(s.z, size.z, &aboveZ);
            // first points in reach from those, and how many they are
            const int startX = (int) ceil(aboveX-reachX), startY = (int) ceil(aboveY-reachY),
                    startZ = (int) ceil(aboveZ-reachZ);
            const int firstZ = belowZ+startZ-floorQuotient(belowZ+startZ, size.z)*size.z;
            const int pointsX = (int) floor(aboveX+reachX)-startX+1, pointsY = (int) floor(aboveY+reachY)-startY+1,
                    pointsZ = (int) floor(aboveZ+reachZ)-startZ+1;
            for (int line = lane/LANES_Z; line < pointsX*pointsY; line += SPHERE_LANES/LANES_Z) {
                const int dx = startX+line/pointsY, dy = startY+line%pointsY;
                const real x = dx-aboveX, y = dy-aboveY;
                const real nearest = SCALE_OF(shape)*squareOfLine(x, y, metric)+SHIFT_OF(shape);
                if (nearest >= 1)
                    continue;
                const real fromMiddle = startZ-aboveZ-middleOfLine(x, y, metric);
                const int indexX = belowX+dx, indexY = belowY+dy;
                const int row = ((indexX-floorQuotient(indexX, size.x)*size.x)*size.y
                        +indexY-floorQuotient(indexY, size.y)*size.y)*size.z;
                for (int dz = lane%LANES_Z; dz < pointsZ; dz += LANES_Z) {
                    const real z = fromMiddle+dz, t = nearest+slope*z*z;
                    if (t >= 1 || t <= LEAST_OF(shape))
                        continue;
                    real w = powers[0];
                    for (int power = 1; power <= SPHERE_DEGREE; power++)
                        w = w*t+powers[power];
                    int point = firstZ+dz;
                    while (point >= size.z)
                        point -= size.z;
                    point += row;
                    sumX += w*gridX[point];
                    sumY += w*gridY[point];
                    sumZ += w*gridZ[point];
                }
            }
        }
        SYNC_THREADS;
        sums[3*LOCAL_ID] = sumX;
        sums[3*LOCAL_ID+1] = sumY;
        sums[3*LOCAL_ID+2] = sumZ;
        SYNC_THREADS;
        if (place < n && lane == 0) {
            real4 total = u[place];
            for (int k = 3*LOCAL_ID; k < 3*LOCAL_ID+3*SPHERE_LANES; k += 3) {
                total.x += sums[k];
                total.y += sums[k+1];
                total.z += sums[k+2];
            }
            u[place] = total;
        }
    }
}
