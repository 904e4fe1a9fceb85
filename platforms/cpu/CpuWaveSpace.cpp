// SPDX-License-Identifier: MIT
#include "CpuWaveSpace.h"
#include "numerics/Window.h"
#include <algorithm>
#include <cmath>

using namespace PSE::numerics;

namespace PSE {

namespace {
constexpr size_t ROW_UNIT = 16; ///< rows begin on cache lines: 16 floats
size_t roundedUp(size_t n) {
    return (n + ROW_UNIT - 1) / ROW_UNIT * ROW_UNIT;
}
/** Reals from one row of a grid to the next: nz points or modes, and the repeated ends of rows. */
size_t gridRow(int nz, int support) {
    return roundedUp(std::max(2 * (nz / 2 + 1), nz + paddedSupport(support)));
}

/** Modes from one row of a block to the next. */
size_t modeRow(int nz) {
    return roundedUp(nz / 2 + 1);
}

} // namespace

template <class Real>
CpuWaveSpace<Real>::CpuWaveSpace(const Plan& plan, const Lattice& box, const Threads& threads)
    : box(box), a(plan.a), threads(threads), support(plan.windowSupport),
      padded(paddedSupport(plan.windowSupport)) {
    std::copy(plan.grid.begin(), plan.grid.end(), size);
    rowLength = gridRow(size[2], support);
    blockLength = modeRow(size[2]);
    for (FftArray<Real>& grid : grids)
        grid.resize(size_t(size[0]) * size[1] * rowLength);
    factors.resize(size_t(size[0]) * size[1] * blockLength);
    for (int i = 0; i < threads.count(); i++)
        blocks.emplace_back(
            new FftArray<Real>(3 * 2 * size[0] * blockLength + waveScratch(blockLength)));
    fft.reset(new GridFft<Real>(size[0], size[1], size[2], rowLength, blockLength));

    const std::vector<Polynomial> pieces =
        Window(support, plan.windowShape).polynomials(plan.tableError);
    windowDegree = pieces[0].degree();
    windowCoefficients.assign((windowDegree + 1) * padded, Real(0));
    for (int power = 0; power <= windowDegree; power++)
        for (int j = 0; j < support; j++)
            windowCoefficients[(windowDegree - power) * padded + j] = Real(pieces[j].powers[power]);
    prepareFactors(plan);
}

template <class Real> double CpuWaveSpace<Real>::bytesPerGridPoint(const Plan& plan) {
    const int nz = plan.grid[2];
    return (3.0 * gridRow(nz, plan.windowSupport) + modeRow(nz)) * sizeof(Real) / nz;
}

template <class Real> void CpuWaveSpace<Real>::prepareFactors(const Plan& plan) {
    const Window window(support, plan.windowShape);
    std::vector<double> inverse[3]; // 1/W^ of each axis
    for (int d = 0; d < 3; d++)
        for (int i = 0; i < size[d]; i++)
            inverse[d].push_back(
                1 / window.transform(2 * M_PI * (2 * i <= size[d] ? i : i - size[d]) / size[d]));
    const Matrix3 waves = a * box.waveVectors();
    const double unit = 6 * M_PI * a * a * a / box.volume();
    threads.run(size[1], [&](int y, int) {
        const int ny = (2 * y <= size[1] ? y : y - size[1]);
        for (int x = 0; x < size[0]; x++) {
            const int nx = (2 * x <= size[0] ? x : x - size[0]);
            Real* row = factors.begin() + (size_t(y) * size[0] + x) * blockLength;
            for (size_t nz = 0; nz < blockLength; nz++) {
                row[nz] = 0;
                // No mean flow, no Nyquist planes (there n and -n coincide on the grid but not in
                // k), no padding.
                const bool zero = (nx == 0 && ny == 0 && nz == 0);
                if (zero || 2 * nx == size[0] || 2 * ny == size[1] || 2 * int(nz) >= size[2])
                    continue;
                const double k = (waves * Vec3(nx, ny, double(nz))).norm();
                const double deconvolution = inverse[0][x] * inverse[1][y] * inverse[2][nz];
                row[nz] = Real(unit * plan.split->waveWeight(k) / (k * k) * deconvolution *
                               deconvolution);
            }
        }
    });
}

template <class Real> void CpuWaveSpace<Real>::setPositions(const std::vector<Vec3>& x) {
    const int n = static_cast<int>(x.size());
    first.resize(3 * n);
    sortedFirst.resize(3 * n);
    offsets.resize(3 * n);
    columnOf.resize(n);
    order.resize(n);
    weights.resize(3 * size_t(n) * padded);
    std::vector<Real> unsorted(3 * n);
    threads.runBlocks(n, [&](int from, int to, int) {
        for (int i = from; i < to; i++) {
            const Vec3 s = box.fractional(x[i]);
            for (int d = 0; d < 3; d++) {
                const double u = (s[d] - std::floor(s[d])) * size[d],
                             begin = std::ceil(u - 0.5 * support);
                unsorted[3 * i + d] = Real(2 * (begin - u) + support - 1);
                first[3 * i + d] = (static_cast<int>(begin) + 2 * size[d]) % size[d];
            }
            columnOf[i] = first[3 * i] * size[1] + first[3 * i + 1];
        }
    });
    sortByColumn();
    const WindowPolynomials<Real> window = {windowDegree, padded, windowCoefficients.data()};
    threads.runBlocks(n, [&](int from, int to, int) {
        for (int slot = from; slot < to; slot++)
            for (int d = 0; d < 3; d++) {
                sortedFirst[3 * slot + d] = first[3 * order[slot] + d];
                offsets[3 * slot + d] = unsorted[3 * order[slot] + d];
            }
        simd.evaluateWindows(window, offsets.data() + 3 * from, to - from,
                             weights.data() + 3 * size_t(from) * padded);
    });
}

/** Counting sort, stable in the particle index: the order depends on the positions alone. */
template <class Real> void CpuWaveSpace<Real>::sortByColumn() {
    columnStart.assign(size_t(size[0]) * size[1] + 1, 0);
    for (int column : columnOf)
        columnStart[column + 1]++;
    for (size_t i = 1; i < columnStart.size(); i++)
        columnStart[i] += columnStart[i - 1];
    std::vector<int> next(columnStart.begin(), columnStart.end() - 1);
    for (size_t i = 0; i < columnOf.size(); i++)
        order[next[columnOf[i]]++] = static_cast<int>(i);
}

template <class Real> GridParticles<Real> CpuWaveSpace<Real>::particles() const {
    return {support,
            padded,
            {size[0], size[1], size[2]},
            rowLength,
            columnStart.data(),
            sortedFirst.data(),
            weights.data(),
            sortedForces.data()};
}

template <class Real> void CpuWaveSpace<Real>::spread(const Real* forces) {
    sortedForces.resize(3 * order.size());
    for (size_t slot = 0; slot < order.size(); slot++)
        for (int c = 0; c < 3; c++)
            sortedForces[3 * slot + c] = forces[3 * size_t(order[slot]) + c];
    const GridParticles<Real> sorted = particles();
    // A plane belongs to one task, which adds the particles in their order: no two threads write
    // one number.
    threads.run(size[0], [&](int x, int) {
        const size_t plane = size_t(x) * size[1] * rowLength;
        Real* planes[3] = {grids[0].begin() + plane, grids[1].begin() + plane,
                           grids[2].begin() + plane};
        simd.spreadPlane(sorted, x, planes);
        for (Real* p : planes)
            fft->planeForward(p);
    });
}

template <class Real> void CpuWaveSpace<Real>::scale(bool forced, Real noise, const NoiseKey& key) {
    const Matrix3 waves = a * box.waveVectors();
    threads.run(size[1], [&](int y, int thread) {
        WaveRow<Real> row = {{size[0], size[1], size[2]},
                             2 * y <= size[1] ? y : y - size[1],
                             blockLength,
                             {},
                             nullptr,
                             forced,
                             noise,
                             key};
        for (int i = 0; i < 9; i++)
            row.waveVectors[i] = Real(waves(i / 3, i % 3));
        row.factors = factors.begin() + size_t(y) * size[0] * blockLength;
        Complex* columns[3];
        for (int c = 0; c < 3; c++)
            columns[c] =
                reinterpret_cast<Complex*>(blocks[thread]->begin()) + c * size[0] * blockLength;
        Real* scratch = blocks[thread]->begin() + 3 * 2 * size[0] * blockLength;
        for (int c = 0; c < 3 && forced; c++)
            fft->columnForward(grids[c].begin() + y * rowLength, columns[c]);
        simd.scaleWaves(row, columns, scratch);
        for (int c = 0; c < 3; c++)
            fft->columnBackward(columns[c], grids[c].begin() + y * rowLength);
    });
}

template <class Real> void CpuWaveSpace<Real>::gather(Real* u) {
    threads.run(size[0], [&](int x, int) {
        for (FftArray<Real>& grid : grids) {
            Real* plane = grid.begin() + size_t(x) * size[1] * rowLength;
            fft->planeBackward(plane);
            for (int y = 0; y < size[1]; y++) {
                Real* row = plane + y * rowLength;
                for (int z = size[2]; z < size[2] + padded; z++)
                    row[z] = row[z - size[2]];
            }
        }
    });
    sortedVelocities.resize(3 * order.size());
    const GridParticles<Real> sorted = particles();
    const Real* data[3] = {grids[0].begin(), grids[1].begin(), grids[2].begin()};
    threads.runBlocks(static_cast<int>(order.size()), [&](int from, int to, int) {
        simd.gatherVelocities(sorted, from, to, data, sortedVelocities.data());
        for (int slot = from; slot < to; slot++)
            for (int c = 0; c < 3; c++)
                u[3 * size_t(order[slot]) + c] += sortedVelocities[3 * size_t(slot) + c];
    });
}

template <class Real>
void CpuWaveSpace<Real>::addVelocities(const Real* forces, Real noise, const NoiseKey& key, Real* u,
                                       StageClock& clock) {
    clock.start();
    if (forces != NULL)
        spread(forces);
    clock.charge("spreading and planes of the transform");
    scale(forces != NULL, noise, key);
    clock.charge("waves (noise, scaling, columns of the transform)");
    gather(u);
    clock.charge("planes of the inverse transform and gathering");
}

template class CpuWaveSpace<float>;
template class CpuWaveSpace<double>;

} // namespace PSE
