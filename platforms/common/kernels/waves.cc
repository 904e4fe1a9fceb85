// SPDX-License-Identifier: MIT
// The wave-space half between spreading and gathering, and the blocks in which grids are made [T4, T9].
// Grids are [x][y][z], one for each component.

// A work group owns a block of grid points and collects the forces of all particles nearby: nothing is
// shared between groups, nothing needs to be zero before, and sums have one order. A thread owns a part
// of a column along z. A tile is what 32 threads own: one part of 4 x 8 columns. Particles are staged
// in local memory, and each tile is told by bits which of them it has to look at.
#define BLOCK_X 8
#define BLOCK_Y 8
#define BLOCK_Z 32
#define PART 8   // points of a thread
#define TILE_X 4 // columns of a tile along x
#define TILES_X (BLOCK_X/TILE_X)
#define PARTS (BLOCK_Z/PART)
#define COLUMNS (BLOCK_X*BLOCK_Y)
#define TILES (PARTS*TILES_X)
#define BATCH 64 // particles staged at once
#define WORDS (BATCH/32)

/** Write one component of a block, neighbouring threads to neighbouring points. */
DEVICE void storeBlock(const real* sums, int4 corner, int4 size, LOCAL_ARG real* buffer, GLOBAL real* RESTRICT grid) {
    const int column = LOCAL_ID%COLUMNS, part = LOCAL_ID/COLUMNS;
    SYNC_THREADS;
    for (int k = 0; k < PART; k++)
        buffer[column*BLOCK_Z+part*PART+k] = sums[k];
    SYNC_THREADS;
    for (int i = LOCAL_ID; i < COLUMNS*BLOCK_Z; i += GROUP_SIZE) {
        const int x = corner.x+i/(BLOCK_Y*BLOCK_Z), y = corner.y+i/BLOCK_Z%BLOCK_Y, z = corner.z+i%BLOCK_Z;
        if (x < size.x && y < size.y && z < size.z)
            grid[(x*size.y+y)*size.z+z] = buffer[i];
    }
}

/** Bit i%32 of words[tile][i/32] is set if particle i of the batch touches the tile. */
DEVICE void collectBits(int count, LOCAL_ARG const int* tiles, LOCAL_ARG unsigned int* words) {
    for (int i = LOCAL_ID; i < TILES*WORDS; i += GROUP_SIZE) {
        const int first = i%WORDS*32, end = first+32 < count ? first+32 : count;
        unsigned int word = 0;
        for (int particle = first; particle < end; particle++)
            word |= (unsigned int) (tiles[particle] >> (i/WORDS) & 1) << (particle-first);
        words[i] = word;
    }
}

/** Signed wave number of an index along an axis. */
DEVICE int waveNumber(int i, int count) {
    return 2*i <= count ? i : i-count;
}

/**
 * D of a box that moves [T36]: scale w(k^2)/k^2 times what belongs to each axis.
 * @param end2           k^2 from which on w = 0
 * @param powers         [degree+1][pieces] of w in t = 2 (k^2 pieces/end2 - piece) - 1, highest first
 * @param deconvolution  of x, then of y, then of z up to half of the grid
 */
KERNEL void makeFactors(int4 size, real scale, real end2, int pieces, int degree, GLOBAL const real* RESTRICT powers,
        GLOBAL const real* RESTRICT deconvolution, GLOBAL const real* RESTRICT waves, GLOBAL real* RESTRICT factors) {
    const int sizeZ = size.z/2+1, modes = size.x*size.y*sizeZ;
    for (int i = GLOBAL_ID; i < modes; i += GLOBAL_SIZE) {
        const int x = i/(size.y*sizeZ), y = i/sizeZ%size.y, nz = i%sizeZ;
        const int nx = waveNumber(x, size.x), ny = waveNumber(y, size.y);
        const real kx = waves[0]*nx+waves[1]*ny+waves[2]*nz, ky = waves[3]*nx+waves[4]*ny+waves[5]*nz,
                kz = waves[6]*nx+waves[7]*ny+waves[8]*nz;
        const real k2 = kx*kx+ky*ky+kz*kz;
        real D = 0;
        if (k2 > 0 && k2 < end2) {
            const real place = k2*pieces/end2;
            const int piece = place < pieces ? (int) place : pieces-1;
            const real t = 2*(place-piece)-1;
            real w = powers[piece];
            for (int power = 1; power <= degree; power++)
                w = w*t+powers[power*pieces+piece];
            if (w > 0)
                D = scale*w/k2*deconvolution[x]*deconvolution[size.x+y]*deconvolution[size.x+size.y+nz];
        }
        factors[i] = D;
    }
}

/**
 * Gridded forces to gridded velocities, in place, thermal part included [T6, T9]:
 *
 *     u(k) = forced D Q f(k) + noise sqrt(D) Q z(k),   Q = I - k k^T/k^2
 *
 * @param waves    k = waves n, row by row
 * @param factors  D >= 0, zero where a mode is not kept
 */
KERNEL void scaleWaves(int4 size, int forced, real noise, int4 key, GLOBAL const real* RESTRICT waves,
        GLOBAL const real* RESTRICT factors, GLOBAL real2* RESTRICT gridX, GLOBAL real2* RESTRICT gridY,
        GLOBAL real2* RESTRICT gridZ) {
    const int sizeZ = size.z/2+1, modes = size.x*size.y*sizeZ;
    for (int i = GLOBAL_ID; i < modes; i += GLOBAL_SIZE) {
        const real D = factors[i];
        real2 x = make_real2(0, 0), y = make_real2(0, 0), z = make_real2(0, 0);
        if (D > 0) {
            const int nx = waveNumber(i/(size.y*sizeZ), size.x), ny = waveNumber(i/sizeZ%size.y, size.y), nz = i%sizeZ;
            if (forced) {
                const real2 fx = gridX[i], fy = gridY[i], fz = gridZ[i];
                x = make_real2(D*fx.x, D*fx.y);
                y = make_real2(D*fy.x, D*fy.y);
                z = make_real2(D*fz.x, D*fz.y);
            }
            if (noise != 0) {
                const real amplitude = noise*SQRT(D);
                real re[3], im[3];
                modeNoise(key.x, key.y, key.z, key.w, nx, ny, nz, re, im);
                x.x += amplitude*re[0];
                x.y += amplitude*im[0];
                y.x += amplitude*re[1];
                y.y += amplitude*im[1];
                z.x += amplitude*re[2];
                z.y += amplitude*im[2];
            }
            const real kx = waves[0]*nx+waves[1]*ny+waves[2]*nz, ky = waves[3]*nx+waves[4]*ny+waves[5]*nz,
                    kz = waves[6]*nx+waves[7]*ny+waves[8]*nz;
            const real scale = 1/(kx*kx+ky*ky+kz*kz);
            const real alongRe = scale*(kx*x.x+ky*y.x+kz*z.x), alongIm = scale*(kx*x.y+ky*y.y+kz*z.y);
            x = make_real2(x.x-alongRe*kx, x.y-alongIm*kx);
            y = make_real2(y.x-alongRe*ky, y.y-alongIm*ky);
            z = make_real2(z.x-alongRe*kz, z.y-alongIm*kz);
        }
        gridX[i] = x;
        gridY[i] = y;
        gridZ[i] = z;
    }
}
