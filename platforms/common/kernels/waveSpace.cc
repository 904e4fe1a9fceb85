// SPDX-License-Identifier: MIT
// Equal spheres between particles and the grid, spread and gathered by one window [T10]. SUPPORT is P,
// the points of the window along an axis. SUPPORT, WINDOW_DEGREE and LANES are numbers, or entries of
// `plan` (PlanConstants).

#define POINTS (3*SUPPORT)

/**
 * Where the windows of particles begin and what they weigh, one thread for each weight.
 * @param coefficients  [WINDOW_DEGREE+1][SUPPORT], highest power first, in t of Window::polynomials
 * @param starts        [n][4] first grid point along each axis, in [0, size); numbers, not vectors: compilers of
 * OpenCL write one component of a vector as all four, and other threads write the others
 * @param weights       [n][3][SUPPORT]
 */
KERNEL void evaluateWindows(int n, int4 size, GLOBAL const int* RESTRICT plan, GLOBAL const fraction4* RESTRICT places,
        GLOBAL const real* RESTRICT coefficients, GLOBAL int* RESTRICT starts, GLOBAL real* RESTRICT weights) {
    for (int i = GLOBAL_ID; i < n*POINTS; i += GLOBAL_SIZE) {
        const int place = i/POINTS, axis = i%POINTS/SUPPORT, point = i%SUPPORT;
        const fraction4 s = places[place];
        const fraction own = (axis == 0 ? s.x : (axis == 1 ? s.y : s.z));
        const int count = (axis == 0 ? size.x : (axis == 1 ? size.y : size.z));
        // u - P/2 in units of 2^-GRID_BITS grid spacings, up to whole ones, and its ceiling
        const mm_long unit = (mm_long) 1 << GRID_BITS;
        const mm_long u = (mm_long) ((mm_ulong) (own >> (FRACTION_BITS-GRID_BITS))*(unsigned int) count)-SUPPORT%2*(unit/2);
        const mm_long up = (u+unit-1) >> GRID_BITS;
        const real t = (real) 2*((real) (up*unit-u)/(real) unit)-1;
        int start = (int) up-SUPPORT/2;
        if (start < 0)
            start += count;
        real weight = coefficients[point];
        for (int power = 1; power <= WINDOW_DEGREE; power++)
            weight = weight*t+coefficients[power*SUPPORT+point];
        weights[i] = weight;
        if (point == 0)
            starts[4*place+axis] = start;
    }
}

#define STAGED (BLOCK_X+BLOCK_Y+BLOCK_Z) // weights of a particle on the points of a block

/** The weight of a window that begins at `start` on a grid point, zero beyond its support. */
DEVICE real weightAt(int point, int start, int count, GLOBAL const int* RESTRICT plan,
        GLOBAL const real* RESTRICT weights) {
    int j = point-start;
    if (j < 0)
        j += count;
    return j < SUPPORT ? weights[j] : 0;
}

/** Cells that hold the particles whose windows touch grid points [from, from+BLOCK) of an axis. */
DEVICE int2 cellsOfBlock(int from, int block, int count, int cells, GLOBAL const int* RESTRICT plan) {
    const int to = (from+block < count ? from+block : count)-1;
    const real margin = (real) 1e-5, reach = (real) 0.5*SUPPORT;
    return cellInterval((from-reach)/count-margin, (to+reach)/count+margin, cells);
}

/** Whether a window that begins at `start` touches one of `points` points that begin at `corner`. */
DEVICE int touches(int start, int corner, int points, int count, GLOBAL const int* RESTRICT plan) {
    int ahead = corner-start;
    if (ahead < 0)
        ahead += count;
    return ahead < SUPPORT || count-ahead < points;
}

/** Bit TILES_X*part+t is set if a window touches tile t of that part of a block. */
DEVICE int touchedTiles(int4 start, int4 corner, int4 size, GLOBAL const int* RESTRICT plan) {
    int tiles = 0;
    if (touches(start.y, corner.y, BLOCK_Y, size.y, plan))
        for (int tile = 0; tile < TILES; tile++)
            if (touches(start.x, corner.x+tile%TILES_X*TILE_X, TILE_X, size.x, plan) &&
                    touches(start.z, corner.z+tile/TILES_X*PART, PART, size.z, plan))
                tiles |= 1 << tile;
    return tiles;
}

/** Weights of a batch of particles on the points of a block, their forces, and the tiles they touch. */
DEVICE void stageParticles(int first, int count, int4 corner, int4 size, GLOBAL const int* RESTRICT plan,
        GLOBAL const int4* RESTRICT starts, GLOBAL const real* RESTRICT weights, GLOBAL const real4* RESTRICT f,
        LOCAL_ARG real* staged, LOCAL_ARG real4* forces, LOCAL_ARG int* tiles) {
    for (int i = LOCAL_ID; i < count*STAGED; i += GROUP_SIZE) {
        const int particle = i/STAGED, point = i%STAGED;
        const int4 start = starts[first+particle];
        GLOBAL const real* RESTRICT own = weights+(first+particle)*(mm_long) POINTS;
        if (point < BLOCK_X)
            staged[i] = weightAt(corner.x+point, start.x, size.x, plan, own);
        else if (point < BLOCK_X+BLOCK_Y)
            staged[i] = weightAt(corner.y+point-BLOCK_X, start.y, size.y, plan, own+SUPPORT);
        else
            staged[i] = weightAt(corner.z+point-BLOCK_X-BLOCK_Y, start.z, size.z, plan, own+2*SUPPORT);
    }
    for (int i = LOCAL_ID; i < count; i += GROUP_SIZE) {
        forces[i] = f[first+i];
        tiles[i] = touchedTiles(starts[first+i], corner, size, plan);
    }
}

DEVICE void addTo(real* sums, real f, real4 weights) {
    sums[0] += f*weights.x;
    sums[1] += f*weights.y;
    sums[2] += f*weights.z;
    sums[3] += f*weights.w;
}

/** Forces on the grid. */
KERNEL void spreadForces(int4 size, int4 cells, GLOBAL const int* RESTRICT plan,
        GLOBAL const int* RESTRICT cellStart,
        GLOBAL const int4* RESTRICT starts, GLOBAL const real* RESTRICT weights, GLOBAL const real4* RESTRICT f,
        GLOBAL real* RESTRICT gridX, GLOBAL real* RESTRICT gridY, GLOBAL real* RESTRICT gridZ) {
    LOCAL real4 stagedVectors[BATCH*STAGED/4], forces[BATCH]; // loaded as vectors where that is possible
    LOCAL int tiles[BATCH];
    LOCAL unsigned int words[TILES*WORDS];
    LOCAL_ARG real* staged = (LOCAL_ARG real*) stagedVectors;
    const int blocksY = (size.y+BLOCK_Y-1)/BLOCK_Y, blocksZ = (size.z+BLOCK_Z-1)/BLOCK_Z;
    const int blocks = (size.x+BLOCK_X-1)/BLOCK_X*blocksY*blocksZ;
    const int column = LOCAL_ID%COLUMNS, part = LOCAL_ID/COLUMNS;
    const int tile = part*TILES_X+column/(TILE_X*BLOCK_Y);
    for (int block = GROUP_ID; block < blocks; block += NUM_GROUPS) {
        const int4 corner = make_int4(block/(blocksY*blocksZ)*BLOCK_X, block/blocksZ%blocksY*BLOCK_Y,
                block%blocksZ*BLOCK_Z, 0);
        const int2 alongX = cellsOfBlock(corner.x, BLOCK_X, size.x, cells.x, plan);
        const int2 alongY = cellsOfBlock(corner.y, BLOCK_Y, size.y, cells.y, plan);
        const int2 alongZ = cellsOfBlock(corner.z, BLOCK_Z, size.z, cells.z, plan);
        real sumX[PART], sumY[PART], sumZ[PART];
        for (int k = 0; k < PART; k++)
            sumX[k] = sumY[k] = sumZ[k] = 0;
        for (int c = 0; c < 2*alongX.y*alongY.y; c++) {
            const int cx = wrapped(alongX.x+c/(2*alongY.y), cells.x), cy = wrapped(alongY.x+c/2%alongY.y, cells.y);
            const int2 run = runOfPlaces(cellStart+(cx*cells.y+cy)*cells.z, alongZ, cells.z, c%2);
            for (int first = run.x; first < run.y; first += BATCH) {
                const int count = run.y-first < BATCH ? run.y-first : BATCH;
                SYNC_THREADS;
                stageParticles(first, count, corner, size, plan, starts, weights, f, staged, forces, tiles);
                SYNC_THREADS;
                collectBits(count, tiles, words);
                SYNC_THREADS;
                for (int k = 0; k < WORDS; k++)
                    for (unsigned int left = words[tile*WORDS+k]; left != 0; left &= left-1) {
                        const int i = 32*k+31-LEADING_ZEROS(left & (~left+1)); // its lowest bit
                        const real w = staged[i*STAGED+column/BLOCK_Y]*staged[i*STAGED+BLOCK_X+column%BLOCK_Y];
                        const real4 force = forces[i];
                        const real fx = w*force.x, fy = w*force.y, fz = w*force.z;
                        for (int point = 0; point < PART; point += 4) {
                            const real4 along = stagedVectors[(i*STAGED+BLOCK_X+BLOCK_Y+part*PART+point)/4];
                            addTo(sumX+point, fx, along);
                            addTo(sumY+point, fy, along);
                            addTo(sumZ+point, fz, along);
                        }
                    }
            }
        }
        storeBlock(sumX, corner, size, staged, gridX);
        storeBlock(sumY, corner, size, staged, gridY);
        storeBlock(sumZ, corner, size, staged, gridZ);
        SYNC_THREADS;
    }
}

/** u += what the grids hold at the particles; LANES >= SUPPORT threads for each, along z. */
KERNEL void gatherVelocities(int n, int4 size, GLOBAL const int* RESTRICT plan, GLOBAL const int4* RESTRICT starts,
        GLOBAL const real* RESTRICT weights, GLOBAL const real* RESTRICT gridX, GLOBAL const real* RESTRICT gridY,
        GLOBAL const real* RESTRICT gridZ, GLOBAL real4* RESTRICT u) {
    LOCAL real sums[3*GROUP_SIZE];
    const int lane = LOCAL_ID%LANES, perGroup = GROUP_SIZE/LANES;
    for (int first = GROUP_ID*perGroup; first < n; first += NUM_GROUPS*perGroup) {
        const int place = first+LOCAL_ID/LANES;
        real x = 0, y = 0, z = 0;
        if (place < n && lane < SUPPORT) {
            const int4 start = starts[place];
            GLOBAL const real* RESTRICT own = weights+place*(mm_long) POINTS;
            const int pointZ = wrapped(start.z+lane, size.z);
            for (int dx = 0; dx < SUPPORT; dx++) {
                const int plane = wrapped(start.x+dx, size.x)*size.y;
                real planeX = 0, planeY = 0, planeZ = 0;
                for (int dy = 0; dy < SUPPORT; dy++) {
                    const int point = (plane+wrapped(start.y+dy, size.y))*size.z+pointZ;
                    const real w = own[SUPPORT+dy];
                    planeX += w*gridX[point];
                    planeY += w*gridY[point];
                    planeZ += w*gridZ[point];
                }
                x += own[dx]*planeX;
                y += own[dx]*planeY;
                z += own[dx]*planeZ;
            }
            x *= own[2*SUPPORT+lane];
            y *= own[2*SUPPORT+lane];
            z *= own[2*SUPPORT+lane];
        }
        SYNC_THREADS;
        sums[3*LOCAL_ID] = x;
        sums[3*LOCAL_ID+1] = y;
        sums[3*LOCAL_ID+2] = z;
        SYNC_THREADS;
        if (place < n && lane == 0) {
            real4 total = u[place];
            for (int k = 3*LOCAL_ID; k < 3*LOCAL_ID+3*LANES; k += 3) {
                total.x += sums[k];
                total.y += sums[k+1];
                total.z += sums[k+2];
            }
            u[place] = total;
        }
    }
}
