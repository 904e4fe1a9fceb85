// SPDX-License-Identifier: MIT
#include "CpuRealSpace.h"
#include <algorithm>
#include <cmath>

using namespace PSE::numerics;

namespace PSE {

namespace {

constexpr int LIST_BLOCK = 8; ///< particles per block of OpenMM's list
/// in radii: the list survives until a particle has moved half of it
constexpr double SKIN = 0.5;
/// of the box: what the list's single precision positions may be off
constexpr double FLOAT_MARGIN = 2e-6;

/** Powers of a polynomial, highest first. */
template <class Real> std::vector<Real> hornerOrder(const Polynomial& p) {
    return std::vector<Real>(p.powers.rbegin(), p.powers.rend());
}

} // namespace

template <class Real>
CpuRealSpace<Real>::CpuRealSpace(const Plan& plan, const Lattice& box, const Threads& threads,
                                 OpenMM::ThreadPool& pool)
    : box(box), a(plan.a), range(plan.realCutoff), sumImages(plan.sumImages), threads(threads),
      pool(pool), list(LIST_BLOCK) {
    const RealTable table = makeRealTable(*plan.split, range / a, plan.tableError);
    self = Real(table.self);
    coefficientsF = hornerOrder<Real>(table.F);
    coefficientsC = hornerOrder<Real>(table.C);
    skin = std::min(SKIN * a, 0.5 * box.smallestWidth() - range);
}

template <class Real> bool CpuRealSpace<Real>::listIsValid(const std::vector<Vec3>& x) const {
    if (x.size() != atBuild.size())
        return false;
    const double margin = FLOAT_MARGIN * (box.length(0) + box.length(1) + box.length(2));
    const double allowed = 0.5 * (skin - margin);
    for (size_t i = 0; i < x.size(); i++)
        if (!((x[i] - atBuild[i]).squaredNorm() < allowed * std::fabs(allowed)))
            return false;
    return true;
}

template <class Real> void CpuRealSpace<Real>::setPositions(const std::vector<Vec3>& x) {
    positions.resize(x.size());
    for (std::vector<double>& axis : axes)
        axis.resize(x.size());
    threads.runBlocks(static_cast<int>(x.size()), [&](int from, int to, int) {
        for (int i = from; i < to; i++) {
            positions[i] = box.wrapped(x[i]);
            for (int d = 0; d < 3; d++)
                axes[d][i] = positions[i][d];
        }
    });
    blockCount.resize(x.size());
    if (sumImages)
        fillRowsWithImages();
    else {
        if (!listIsValid(x))
            buildList(x);
        fillRows();
    }
}

template <class Real> void CpuRealSpace<Real>::buildList(const std::vector<Vec3>& x) {
    const int n = static_cast<int>(x.size());
    atBuild.clear(); // no list while it is being built: an exception must not leave half of one
    if (listPositions.size() != 4 * n) {
        listPositions.resize(4 * n);
        noExclusions.resize(n);
    }
    // OpenMM's list wants x in [0, ax), y in [0, by), z in [0, cz): a brick, not the primary box.
    const Matrix3& v = box.vectors();
    for (int i = 0; i < n; i++) {
        Vec3 p = positions[i];
        for (int d = 2; d >= 0; d--)
            p -= v.col(d) * std::floor(p[d] / v(d, d));
        for (int d = 0; d < 3; d++)
            listPositions[4 * i + d] = float(p[d]);
        listPositions[4 * i + 3] = 0;
    }
    OpenMM::Vec3 vectors[3];
    for (int d = 0; d < 3; d++)
        vectors[d] = OpenMM::Vec3(box.vectors()(0, d), box.vectors()(1, d), box.vectors()(2, d));
    list.computeNeighborList(n, listPositions, noExclusions, vectors, true, float(range + skin),
                             pool);

    // From pairs in blocks, each once, to complete rows: count, then fill, then sort each row.
    candidateStart.assign(n + 1, 0);
    const auto forEachPair = [&](auto work) {
        const std::vector<int32_t>& sorted = list.getSortedAtoms();
        for (int block = 0; block < list.getNumBlocks(); block++) {
            OpenMM::CpuNeighborList::NeighborIterator neighbours = list.getNeighborIterator(block);
            while (neighbours.next())
                for (int k = 0; k < LIST_BLOCK; k++)
                    if ((neighbours.getExclusions() & (1 << k)) == 0)
                        work(sorted[LIST_BLOCK * block + k], neighbours.getNeighbor());
        }
    };
    forEachPair([&](int i, int j) { candidateStart[i + 1]++, candidateStart[j + 1]++; });
    blockStart.assign(n + 1, 0);
    for (int i = 0; i < n; i++) {
        blockStart[i + 1] = blockStart[i] + (candidateStart[i + 1] + PAIR_LANES - 1) / PAIR_LANES;
        candidateStart[i + 1] += candidateStart[i];
    }
    candidates.resize(candidateStart[n]);
    blocks.resize(blockStart[n]);
    std::vector<int64_t> next(candidateStart.begin(), candidateStart.end() - 1);
    forEachPair([&](int i, int j) { candidates[next[i]++] = j, candidates[next[j]++] = i; });
    threads.runBlocks(n, [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            std::sort(candidates.begin() + candidateStart[i],
                      candidates.begin() + candidateStart[i + 1]);
    });
    atBuild = x;
}

template <class Real> PairPolynomials<Real> CpuRealSpace<Real>::polynomials() const {
    return {Real(range / a), int(coefficientsF.size()) - 1, int(coefficientsC.size()) - 1,
            coefficientsF.data(), coefficientsC.data()};
}

template <class Real> void CpuRealSpace<Real>::fillRows() {
    const PairPolynomials<Real> table = polynomials();
    const Matrix3& v = box.vectors();
    const PairGeometry geometry = {
        axes[0].data(), axes[1].data(),
        axes[2].data(), {v(0, 0), v(0, 1), v(1, 1), v(0, 2), v(1, 2), v(2, 2)},
        range,          a};
    threads.runBlocks(static_cast<int>(positions.size()), [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            blockCount[i] = simd.fillRow(geometry, table, i, candidates.data() + candidateStart[i],
                                         int(candidateStart[i + 1] - candidateStart[i]),
                                         blocks.data() + blockStart[i]);
    });
}

/**
 * For ranges beyond half the box: every image of every pair. Few particles, or a range never chosen
 * automatically.
 */
template <class Real> void CpuRealSpace<Real>::fillRowsWithImages() {
    const PairPolynomials<Real> table = polynomials();
    const std::vector<Vec3> images = box.imagesWithin(range);
    const int n = static_cast<int>(positions.size());
    std::vector<std::vector<PairBlock<Real>>> found(n);
    threads.run(n, [&](int i, int) {
        int used = PAIR_LANES;
        for (int j = 0; j < n; j++)
            for (const Vec3& image : images) {
                const Vec3 d = positions[i] - positions[j] + image;
                if (d.squaredNorm() >= range * range || (i == j && image == Vec3::Zero()))
                    continue;
                if (used == PAIR_LANES) {
                    found[i].push_back({});
                    used = 0;
                }
                PairBlock<Real>& block = found[i].back();
                block.neighbour[used] = j;
                block.dx[used] = Real(d[0] / a);
                block.dy[used] = Real(d[1] / a);
                block.dz[used++] = Real(d[2] / a);
            }
        simd.evaluateBlocks(table, static_cast<int>(found[i].size()), used, found[i].data());
    });
    blockStart.assign(n + 1, 0);
    blocks.clear();
    for (int i = 0; i < n; i++) {
        blockCount[i] = static_cast<int32_t>(found[i].size());
        blockStart[i + 1] = blockStart[i] + blockCount[i];
        blocks.insert(blocks.end(), found[i].begin(), found[i].end());
    }
}

template <class Real> PairRows<Real> CpuRealSpace<Real>::rows() const {
    return {self, blockStart.data(), blockCount.data(), blocks.data()};
}

template <class Real> void CpuRealSpace<Real>::multiply(const Vector& v, Vector& out) const {
    const PairRows<Real> matrix = rows();
    threads.runBlocks(static_cast<int>(positions.size()), [&](int from, int to, int) {
        simd.multiplyRows(matrix, from, to, v.data(), out.data());
    });
}

template <class Real> typename CpuRealSpace<Real>::Vector& CpuRealSpace<Real>::basis(int i) {
    while (static_cast<int>(krylov.size()) <= i)
        krylov.emplace_back();
    krylov[i].resize(3 * positions.size());
    return krylov[i];
}

template <class Real> double CpuRealSpace<Real>::dot(const Vector& v, const Vector& w) const {
    const int n = static_cast<int>(v.size());
    partial.assign(Threads::blocks(n), 0.0);
    threads.runBlocks(n, [&](int from, int to, int block) {
        double sum = 0;
        for (int i = from; i < to; i++)
            sum += double(v[i]) * double(w[i]);
        partial[block] = sum;
    });
    double total = 0;
    for (double sum : partial)
        total += sum;
    return total;
}

template <class Real>
void CpuRealSpace<Real>::scaledCopy(double s, const Vector& v, Vector& out) const {
    threads.runBlocks(static_cast<int>(v.size()), [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            out[i] = Real(s) * v[i];
    });
}

template <class Real>
void CpuRealSpace<Real>::addScaled(double s, const Vector& v, Vector& out) const {
    threads.runBlocks(static_cast<int>(v.size()), [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            out[i] += Real(s) * v[i];
    });
}

template class CpuRealSpace<float>;
template class CpuRealSpace<double>;

} // namespace PSE
