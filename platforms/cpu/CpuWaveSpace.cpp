// SPDX-License-Identifier: MIT
#include "CpuWaveSpace.h"
#include "CpuSphereSpread.h"
#include "CpuWindowSpread.h"
#include "ParticleOrder.h"
#include <algorithm>
#include <cmath>

using namespace PSE::numerics;

namespace PSE {

namespace {

constexpr size_t ROW_UNIT = 16; ///< rows begin on cache lines: 16 floats
size_t roundedUp(size_t n, size_t unit) {
    return (n + unit - 1) / unit * unit;
}

int waveChunks(int nz) {
    return (nz / 2 + WAVE_LANES) / WAVE_LANES;
}

/** Reals from one row of a grid to the next: whole chunks of modes, or points and repeated ends. */
size_t gridRow(int nz, int padding) {
    return roundedUp(std::max(2 * WAVE_LANES * waveChunks(nz), nz + padding), ROW_UNIT);
}

/** From one plane to the next: an odd number of units, so that columns spread over the caches. */
size_t gridPlane(int ny, size_t rowLength) {
    const size_t units = ny * rowLength / ROW_UNIT;
    return (units + 1 - units % 2) * ROW_UNIT;
}

template <class Real>
std::unique_ptr<CpuSpread<Real>> makeSpreading(const Plan& plan, const Lattice& box,
                                               const Threads& threads) {
    if (plan.mixture)
        return std::make_unique<CpuSphereSpread<Real>>(plan, box, threads);
    return std::make_unique<CpuWindowSpread<Real>>(plan);
}

} // namespace

template <class Real>
CpuWaveSpace<Real>::CpuWaveSpace(const Plan& plan, const Lattice& box, const Threads& threads)
    : box(box), a(plan.a), threads(threads), spreading(makeSpreading<Real>(plan, box, threads)) {
    std::copy(plan.grid.begin(), plan.grid.end(), size);
    chunks = waveChunks(size[2]);
    rowLength = gridRow(size[2], spreading->padding());
    planeLength = gridPlane(size[1], rowLength);
    spreading->setLayout(rowLength, planeLength);
    for (FftArray<Real>& grid : grids) {
        grid.resize(size[0] * planeLength);
        std::fill(grid.begin(), grid.begin() + size[0] * planeLength, Real(0));
    }
    factors.resize(factorRow(size[1], 0, 0));
    keptChunks.assign(size[1], 0);
    const size_t room = std::max((3 * spreading->planesTogether() + 1) * planeLength,
                                 size_t(3 * 2) * size[0] * WAVE_LANES);
    for (int i = 0; i < threads.count(); i++) {
        scratch.emplace_back(new FftArray<Real>(room));
        std::fill(scratch[i]->begin(), scratch[i]->begin() + room, Real(0));
    }
    fft.reset(new GridFft<Real>({{size[0], size[1], size[2]}, rowLength, planeLength, WAVE_LANES}));

    if (plan.moving)
        prepareMovingFactors(plan);
    else
        prepareFactors(WaveFactors(plan, box));
}

template <class Real> double CpuWaveSpace<Real>::bytesPerParticle(const Plan& plan) {
    return plan.mixture ? CpuSphereSpread<Real>::bytesPerParticle(plan)
                        : CpuWindowSpread<Real>::bytesPerParticle(plan);
}

template <class Real>
double CpuWaveSpace<Real>::bytesPerGridPoint(const Plan& plan, const Lattice& box) {
    const int ny = plan.grid[1], nz = plan.grid[2];
    const int padding = plan.mixture ? CpuSphereSpread<Real>::paddingOf(plan, box)
                                     : paddedSupport(plan.windowSupport);
    const double plane = gridPlane(ny, gridRow(nz, padding)),
                 factors = double(ny) * waveChunks(nz) * WAVE_LANES;
    return (3 * plane + factors) * sizeof(Real) / (double(ny) * nz);
}

template <class Real> void CpuWaveSpace<Real>::prepareFactors(const WaveFactors& waves) {
    threads.run(size[1], [&](int y, int) {
        for (int x = 0; x < size[0]; x++)
            for (int z = 0; z < chunks * WAVE_LANES; z++) {
                const int chunk = z / WAVE_LANES;
                Real& factor = factors[factorRow(y, chunk, x) + z % WAVE_LANES];
                factor = Real(waves(x, y, z)); // 0 for the padding, too
                if (factor > 0)
                    keptChunks[y] = std::max(keptChunks[y], chunk + 1);
            }
    });
}

template <class Real> void CpuWaveSpace<Real>::prepareMovingFactors(const Plan& plan) {
    moving.reset(new MovingWaveFactors(plan));
    const std::vector<double>& powers = moving->weight.powers;
    weightCoefficients.assign(powers.begin(), powers.end());
    for (int d = 0; d < 3; d++) {
        const std::vector<double>& exact = moving->deconvolution[d];
        deconvolution[d].assign(d < 2 ? size[d] : chunks * WAVE_LANES, Real(0));
        for (size_t i = 0; i < exact.size(); i++)
            deconvolution[d][i] = Real(exact[i]);
    }
    setBox(box);
}

/** What all columns of modes share. */
template <class Real> FactorColumns<Real> CpuWaveSpace<Real>::factorColumns() const {
    FactorColumns<Real> columns = {};
    columns.sizeX = size[0];
    const Matrix3 waves = a * box.waveVectors();
    for (int i = 0; i < 9; i++)
        columns.waveVectors[i] = Real(waves(i / 3, i % 3));
    columns.inverseX = deconvolution[0].data();
    columns.last2 = Real(moving->weight.end2);
    columns.pieces = moving->weight.pieces;
    columns.degree = moving->weight.degree;
    columns.coefficients = weightCoefficients.data();
    return columns;
}

template <class Real> void CpuWaveSpace<Real>::setBox(const Lattice& other) {
    box = other;
    spreading->setBox(box);
    const FactorColumns<Real> shared = factorColumns();
    const double scale = moving->scale(box);
    threads.run(size[1], [&](int y, int) {
        FactorColumns<Real> columns = shared;
        columns.ny = waveIndex(1, y);
        columns.inverseY = Real(scale) * deconvolution[1][y];
        keptChunks[y] = 0;
        for (int chunk = 0; chunk < chunks; chunk++) {
            columns.firstZ = chunk * WAVE_LANES;
            columns.inverseZ = deconvolution[2].data() + columns.firstZ;
            if (waveLoops.fillFactors(columns, factors.begin() + factorRow(y, chunk, 0)))
                keptChunks[y] = chunk + 1;
        }
    });
}

template <class Real> void CpuWaveSpace<Real>::setPositions(const std::vector<Vec3>& fractions) {
    placeParticles(
        threads, fractions, [](int, int) {}, *this);
}

template <class Real> void CpuWaveSpace<Real>::spread() {
    // A plane belongs to one task, which adds the particles in their order: no two threads write
    // one number.
    const int together = spreading->planesTogether();
    threads.run((size[0] + together - 1) / together, [&](int task, int thread) {
        const int x = task * together, number = std::min(together, size[0] - x);
        Real* const own = scratch[thread]->begin();
        Real* const planes[3] = {own, own + together * planeLength,
                                 own + 2 * together * planeLength};
        spreading->spreadPlanes(x, number, planes);
        for (int c = 0; c < 3; c++)
            for (int p = 0; p < number; p++)
                fft->planeForward(planes[c] + p * planeLength, own + 3 * together * planeLength,
                                  grids[c].begin() + (x + p) * planeLength);
    });
}

template <class Real> void CpuWaveSpace<Real>::scale(bool forced, Real noise, const NoiseKey& key) {
    WaveColumns<Real> columns = {size[0], 0, 0, {}, nullptr, forced, noise, key};
    const Matrix3 waves = a * box.waveVectors();
    for (int i = 0; i < 9; i++)
        columns.waveVectors[i] = Real(waves(i / 3, i % 3));
    threads.run(size[1], [&](int y, int thread) { scaleLine(y, thread, columns); });
}

/** All columns of modes at one y. */
template <class Real>
void CpuWaveSpace<Real>::scaleLine(int y, int thread, WaveColumns<Real> columns) {
    columns.ny = waveIndex(1, y);
    Complex* blocks[3];
    for (int c = 0; c < 3; c++)
        blocks[c] = reinterpret_cast<Complex*>(scratch[thread]->begin()) + c * size[0] * WAVE_LANES;
    for (int chunk = 0; chunk < keptChunks[y]; chunk++) {
        columns.firstZ = chunk * WAVE_LANES;
        columns.factors = factors.begin() + factorRow(y, chunk, 0);
        const size_t corner = y * rowLength + 2 * columns.firstZ;
        for (int c = 0; c < 3 && columns.forced; c++)
            fft->columnForward(grids[c].begin() + corner, blocks[c]);
        waveLoops.scaleColumns(columns, blocks);
        for (int c = 0; c < 3; c++)
            fft->columnBackward(blocks[c], grids[c].begin() + corner);
    }
    const size_t kept = size_t(2 * WAVE_LANES) * keptChunks[y],
                 all = size_t(2 * WAVE_LANES) * chunks;
    for (FftArray<Real>& grid : grids)
        for (int x = 0; x < size[0] && kept < all; x++) {
            Real* const row = grid.begin() + x * planeLength + y * rowLength;
            std::fill(row + kept, row + all, Real(0));
        }
}

template <class Real> void CpuWaveSpace<Real>::gather(double unit, std::vector<Vec3>& u) {
    threads.run(size[0], [&](int x, int thread) {
        for (FftArray<Real>& grid : grids) {
            Real* const plane = grid.begin() + x * planeLength;
            fft->planeBackward(plane, scratch[thread]->begin());
            for (int y = 0; y < size[1]; y++) {
                Real* const row = plane + y * rowLength;
                for (int z = size[2]; z < size[2] + spreading->padding(); z++)
                    row[z] = row[z - size[2]];
            }
        }
    });
    const Real* data[3] = {grids[0].begin(), grids[1].begin(), grids[2].begin()};
    threads.runBlocks(spreading->places(), [&](int from, int to, int) {
        spreading->addGathered(data, unit, from, to, u);
    });
}

template <class Real>
void CpuWaveSpace<Real>::addVelocities(bool forced, Real noise, const NoiseKey& key, double unit,
                                       std::vector<Vec3>& u, StageClock& clock) {
    clock.start();
    if (forced)
        spread();
    clock.charge("spreading and planes of the transform");
    scale(forced, noise, key);
    clock.charge("waves (noise, scaling, columns of the transform)");
    gather(unit, u);
    clock.charge("planes of the inverse transform and gathering");
}

template class CpuWaveSpace<float>;
template class CpuWaveSpace<double>;

} // namespace PSE
