// SPDX-License-Identifier: MIT
#include "CpuRealSpace.h"
#include "ParticleOrder.h"
#include "numerics/RealTable.h"
#include <algorithm>

using namespace PSE::numerics;

namespace PSE {

namespace {

/// Cells along the last box vector per range: thin ones, because the cells of a run follow each
/// other in memory and only its ends are searched in vain.
constexpr int CELLS_PER_RANGE = 4;
/// what rounding in single precision may do to a distance, relative to the range, and more
constexpr double MARGIN = 1e-6;
/// room for rows beyond the present need: they fluctuate from step to step
constexpr double ROOM = 1.05;

/** Powers of a polynomial, highest first. */
template <class Real> std::vector<Real> hornerOrder(const Polynomial& p) {
    return std::vector<Real>(p.powers.rbegin(), p.powers.rend());
}

/**
 * Cells [from, from + number) along one axis, modulo `count`, that the interval s +- reach meets;
 * reach < 1.
 */
struct CellInterval {
    int from, number, count;

    CellInterval(double s, double reach, int count) : count(count) {
        // one box up, where truncation rounds down
        low = static_cast<int>((s - reach + 1) * count);
        number = std::min(static_cast<int>((s + reach + 1) * count) - low + 1, count);
        from = (number == count ? 0 : (low >= count ? low - count : low));
    }
    int cell(int i) const { return from + i < count ? from + i : from + i - count; }
    /** From s to the nearest end of cell i, in cells; 0 within. */
    double way(int i, double s) const {
        const double below = low + i - (s + 1) * count;
        return number == count ? 0 : below > 0 ? below : std::min(0.0, 1 + below);
    }

private:
    int low;
};
/**
 * Lower bound of |x|^2 = h^T Q h, over what lies beyond a corner: h_0/p >= 1 and h_1/q >= 1.
 * @param Q  positive definite: h are coordinates along two box vectors, the third is free
 */
double squaredDistanceOfCorner(const double Q[3], double p, double q) {
    const double mixed = Q[1] * p * q;
    if (mixed < -Q[2] * q * q) // nearer along the edge p than at the corner
        return (Q[0] - Q[1] * Q[1] / Q[2]) * p * p;
    if (mixed < -Q[0] * p * p)
        return (Q[2] - Q[1] * Q[1] / Q[0]) * q * q;
    return Q[0] * p * p + 2 * mixed + Q[2] * q * q;
}
/// cells of one axis that a range of at most one cell can meet, and one for rounding
constexpr int MOST_CELLS = 4;

} // namespace

template <class Real>
CpuRealSpace<Real>::CpuRealSpace(const Plan& plan, const Lattice& box, const Threads& threads)
    : KrylovVectors<Real>(threads), box(box), a(plan.a), range(plan.realCutoff),
      sumImages(plan.sumImages), candidateRoom(threads.count()) {
    setBox(box);
    if (plan.mixture) {
        mixture.reset(new CpuMixturePairs<Real>(plan, threads.count()));
        return;
    }
    const RealTable table = makeRealTable(*plan.split, range / a, plan.tableError);
    self = Real(table.self);
    rpy = table.rpy;
    coefficientsF = hornerOrder<Real>(table.F);
    coefficientsC = hornerOrder<Real>(table.C);
}

template <class Real> double CpuRealSpace<Real>::bytesPerParticle(const Plan& plan) {
    return 0.5 * sizeof(PairBlock<Real>) + 10 * 3 * sizeof(Real) + 64 +
           (plan.mixture ? CpuMixturePairs<Real>::bytesPerParticle() : 0);
}

template <class Real> void CpuRealSpace<Real>::setBox(const Lattice& other) {
    box = other;
    const Matrix3& v = box.vectors();
    tilted = v(0, 1) != 0 || v(0, 2) != 0 || v(1, 2) != 0;
    for (int d = 0; d < 3; d++)
        width[d] = box.width(d);
    const Matrix3 inverse = v.inverse();
    const Vec3 x = inverse.row(0), y = inverse.row(1);
    const double determinant = x.squaredNorm() * y.squaredNorm() - x.dot(y) * x.dot(y);
    planeMetric[0] = y.squaredNorm() / determinant;
    planeMetric[1] = -x.dot(y) / determinant;
    planeMetric[2] = x.squaredNorm() / determinant;
}

template <class Real> void CpuRealSpace<Real>::setPositions(const std::vector<Vec3>& fractions) {
    placeParticles(
        threads, fractions, [](int, int) {}, *this);
    findNeighbours(fractions);
}

template <class Real> void CpuRealSpace<Real>::begin(int particles) {
    this->resize(particles);
    rowStart.resize(particles);
    rowCount.resize(particles);
    blocks.resize(Threads::blocks(particles));
    cellOf.resize(particles);
    for (auto& axis : axes)
        axis.resize(particles + PAIR_LANES);
    if (mixture)
        mixture->begin(particles);
    prepareCells(particles);
}

template <class Real> void CpuRealSpace<Real>::findNeighbours(const std::vector<Vec3>& fractions) {
    if (sumImages)
        fillRowsWithImages(fractions);
    else
        threads.run(static_cast<int>(blocks.size()),
                    [&](int task, int thread) { fillRowsOf(task, thread, fractions); });
}

/** Columns of cells about as wide as the range; not many more cells than particles. */
template <class Real> void CpuRealSpace<Real>::prepareCells(int particles) {
    for (int d = 0; d < 3; d++) {
        reach[d] = (1 + MARGIN) * range / width[d];
        cellCount[d] = std::max(1, static_cast<int>((d < 2 ? 1 : CELLS_PER_RANGE) / reach[d]));
    }
    const int most = 2 * particles + 1;
    while (cellCount[0] > most / cellCount[1])
        for (int d = 0; d < 2; d++)
            cellCount[d] = (cellCount[d] + 1) / 2;
    cellCount[2] = std::min(cellCount[2], std::max(1, most / (cellCount[0] * cellCount[1])));
    for (int d = 0; d < 2; d++)
        cellSize[d] = (tilted ? 1 : width[d]) / cellCount[d];
}

template <class Real>
void CpuRealSpace<Real>::assign(const std::vector<Vec3>& fractions, int from, int to) {
    for (int i = from; i < to; i++) {
        int cell = 0;
        for (int d = 0; d < 3; d++)
            cell = cell * cellCount[d] +
                   std::min(static_cast<int>(fractions[i][d] * cellCount[d]), cellCount[d] - 1);
        cellOf[i] = cell;
    }
}

template <class Real> void CpuRealSpace<Real>::sort() {
    sortByKey(cellOf, cellCount[0] * cellCount[1] * cellCount[2], cellStart, particleAt);
}

template <class Real>
void CpuRealSpace<Real>::place(const std::vector<Vec3>& fractions, int from, int to) {
    for (int place = from; place < to; place++)
        for (int d = 0; d < 3; d++)
            axes[d][place] = PairCoordinate<Real>::fromFraction(fractions[particleAt[place]][d]);
    if (mixture)
        mixture->place(particleAt, from, to);
}

/**
 * The runs of places, at most two for each column of cells, that hold all neighbours of s.
 * @param share  of the largest range, the largest one that s has
 */
template <class Real>
int CpuRealSpace<Real>::findRuns(const Vec3& s, double share, PairRun* runs) const {
    const double own = share * range;
    const CellInterval x(s[0], share * reach[0], cellCount[0]),
        y(s[1], share * reach[1], cellCount[1]), z(s[2], share * reach[2], cellCount[2]);
    const int end = z.from + z.number, last = std::min(end, cellCount[2]),
              wrapped = std::max(end - cellCount[2], 0);
    const double most = (1 + 2 * MARGIN) * own * own;
    double wayY[MOST_CELLS];
    const int* columns[MOST_CELLS]; // of the first row
    for (int j = 0; j < y.number; j++) {
        wayY[j] = y.way(j, s[1]) * cellSize[1];
        columns[j] = cellStart.data() + y.cell(j) * cellCount[2];
    }
    int n = 0;
    for (int i = 0; i < x.number; i++) {
        const double wayX = x.way(i, s[0]) * cellSize[0], left = most - wayX * wayX;
        const size_t row = size_t(x.cell(i)) * cellCount[1] * cellCount[2];
        for (int j = 0; j < y.number; j++) {
            // a corner column may be out of range: hard to predict, so its runs are overwritten
            const bool near = tilted
                                  ? wayX * wayY[j] == 0 ||
                                        squaredDistanceOfCorner(planeMetric, wayX, wayY[j]) < most
                                  : wayY[j] * wayY[j] < left;
            const int* const start = columns[j] + row;
            runs[n] = {start[z.from], start[last]};
            n += near;
            if (wrapped > 0) {
                runs[n] = {start[0], start[wrapped]};
                n += near;
            }
        }
    }
    return n;
}

template <class Real> PairScratch<Real> CpuRealSpace<Real>::Candidates::room(size_t count) {
    if (found.size() < count) {
        found.resize(count);
        for (std::vector<Real>* axis : {&dx, &dy, &dz})
            axis->resize(count);
    }
    return {found.data(), dx.data(), dy.data(), dz.data()};
}

template <class Real>
void CpuRealSpace<Real>::fillRowsOf(int task, int thread, const std::vector<Vec3>& fractions) {
    const PairPolynomials<Real> table = polynomials();
    const PairGeometry<Real> positions = geometry();
    PairRun runs[2 * MOST_CELLS * MOST_CELLS + 1];
    std::vector<PairBlock<Real>>& mine = blocks[task];
    const int from = Threads::from(task), to = Threads::to(task, static_cast<int>(rowStart.size()));
    int used = 0;
    for (int i = from; i < to; i++) {
        const double share = (mixture ? mixture->largestRange(i) * a / range : 1);
        const int numRuns = findRuns(fractions[particleAt[i]], share, runs);
        size_t candidates = PAIR_LANES;
        for (int r = 0; r < numRuns; r++)
            candidates += runs[r].end - runs[r].begin;
        const PairScratch<Real> scratch = candidateRoom[thread].room(candidates);
        const size_t needed = used + candidates / PAIR_LANES;
        if (mine.size() < needed) {
            const double likely = ROOM * used / std::max(1, i - from) * (to - from);
            mine.reserve(std::max(needed, static_cast<size_t>(likely)));
            mine.resize(mine.capacity());
        }
        rowStart[i] = used;
        PairBlock<Real>* const row = mine.data() + used;
        rowCount[i] = mixture ? mixture->fillRow(thread, positions, i, runs, numRuns, scratch, row)
                              : kernels.fillRow(positions, table, i, runs, numRuns, scratch, row);
        used += rowCount[i];
    }
}

/**
 * For ranges beyond half the box: every image of every pair. Few particles, or a range never chosen
 * automatically.
 */
template <class Real>
void CpuRealSpace<Real>::fillRowsWithImages(const std::vector<Vec3>& fractions) {
    const PairPolynomials<Real> table = polynomials();
    const std::vector<Vec3> images = box.imagesWithin(range);
    const int n = static_cast<int>(fractions.size());
    threads.run(Threads::blocks(n), [&](int task, int thread) {
        std::vector<PairBlock<Real>>& mine = blocks[task];
        mine.clear();
        for (int i = Threads::from(task); i < Threads::to(task, n); i++) {
            rowStart[i] = static_cast<int32_t>(mine.size());
            int used = PAIR_LANES;
            for (int j = 0; j < n; j++) {
                const double own = (mixture ? mixture->range(i, j) * a : range);
                for (const Vec3& image : images) {
                    const Vec3 d =
                        box.cartesian(fractions[particleAt[i]] - fractions[particleAt[j]]) + image;
                    if (d.squaredNorm() >= own * own || (i == j && image == Vec3::Zero()))
                        continue;
                    if (used == PAIR_LANES) {
                        mine.push_back({});
                        used = 0;
                    }
                    PairBlock<Real>& block = mine.back();
                    block.offset[used] = 3 * j;
                    block.dx[used] = Real(d[0] / a);
                    block.dy[used] = Real(d[1] / a);
                    block.dz[used++] = Real(d[2] / a);
                }
            }
            rowCount[i] = static_cast<int32_t>(mine.size()) - rowStart[i];
            PairBlock<Real>* const row = mine.data() + rowStart[i];
            if (mixture)
                mixture->evaluateRow(thread, i, rowCount[i], used, row);
            else
                kernels.evaluateBlocks(table, rowCount[i], used, row);
        }
    });
}

template <class Real> PairPolynomials<Real> CpuRealSpace<Real>::polynomials() const {
    return {rpy,
            Real(range / a),
            int(coefficientsF.size()) - 1,
            int(coefficientsC.size()) - 1,
            coefficientsF.data(),
            coefficientsC.data()};
}

template <class Real> PairGeometry<Real> CpuRealSpace<Real>::geometry() const {
    const Matrix3 v = box.vectors() / a;
    // Fractions of a displacement within the range are below its reach: the nearest ones are its
    // own where that is at most half a box vector, whatever the tilt.
    const bool reachesFar = *std::max_element(reach, reach + 3) > 0.5;
    const auto unit = [](double length) { return Real(length * PairCoordinate<Real>::UNIT); };
    return {
        axes[0].data(),
        axes[1].data(),
        axes[2].data(),
        {unit(v(0, 0)), unit(v(0, 1)), unit(v(1, 1)), unit(v(0, 2)), unit(v(1, 2)), unit(v(2, 2))},
        {Real(v(0, 0)), Real(v(0, 1)), Real(v(1, 1))},
        tilted && reachesFar,
        Real(range / a)};
}

template <class Real> PairRows<Real> CpuRealSpace<Real>::rows(int task) const {
    return {self, mixture ? mixture->selves() : nullptr, rowStart.data(), rowCount.data(),
            blocks[task].data()};
}

template <class Real>
double CpuRealSpace<Real>::multiplyAdd(const Vector& v, double s, const Vector& w, double t,
                                       Vector& out) const {
    return this->sumOverTasks([&](int from, int to, int task) {
        return kernels.multiplyRows(rows(task), from, to, v.data(), Real(s), w.data(), Real(t),
                                    out.data());
    });
}

template class CpuRealSpace<float>;
template class CpuRealSpace<double>;

} // namespace PSE
