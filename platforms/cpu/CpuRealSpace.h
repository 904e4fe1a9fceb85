// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUREALSPACE_H_
#define OPENMMPSE_CPUREALSPACE_H_

#include "SimdKernels.h"
#include "Threads.h"
#include "numerics/Plan.h"
#include "numerics/RealTable.h"
#include "openmm/cpu/AlignedArray.h"
#include "openmm/cpu/CpuNeighborList.h"
#include <deque>
#include <set>

namespace PSE {

/**
 * The real-space half as a sparse matrix of 3x3 blocks [T7], from OpenMM's neighbour list with a
 * skin. Rows are complete and in the order of particle indices, cut exactly at the range: the
 * result depends on the current positions alone, not on when the list was built nor on threads.
 * Mobilities in units of 1/(6 pi eta a).
 */
template <class Real> class CpuRealSpace {
public:
    using Vector = std::vector<Real>;

    CpuRealSpace(const numerics::Plan& plan, const numerics::Lattice& box, const Threads& threads,
                 OpenMM::ThreadPool& pool);
    void setPositions(const std::vector<numerics::Vec3>& x);

    /** out = M_R v, both [n][3]. */
    void multiply(const Vector& v, Vector& out) const;

    // The vector operations of lanczosSquareRoot(); sums are taken block by block, in an order of
    // their own.
    Vector& basis(int i);
    double dot(const Vector& v, const Vector& w) const;
    void scaledCopy(double s, const Vector& v, Vector& out) const;
    void addScaled(double s, const Vector& v, Vector& out) const;

private:
    bool listIsValid(const std::vector<numerics::Vec3>& x) const;
    void buildList(const std::vector<numerics::Vec3>& x);
    void fillRows();
    void fillRowsWithImages();
    PairPolynomials<Real> polynomials() const;
    PairRows<Real> rows() const;

    numerics::Lattice box;
    double a, range, skin;
    bool sumImages;
    const Threads& threads;
    const SimdKernels<Real>& simd = simdKernels<Real>();
    OpenMM::ThreadPool& pool;
    Real self;
    std::vector<Real> coefficientsF, coefficientsC;
    OpenMM::CpuNeighborList list;
    OpenMM::AlignedArray<float> listPositions;
    std::vector<std::set<int>> noExclusions;
    std::vector<numerics::Vec3> positions; ///< in the primary box
    std::vector<double> axes[3];           ///< the same, one array per coordinate
    std::vector<numerics::Vec3> atBuild;   ///< as given when the list was built
    std::vector<int32_t> candidates;       ///< neighbours within range + skin, row by row
    std::vector<int64_t> candidateStart;   ///< [n + 1]
    std::vector<int64_t> blockStart;       ///< [n + 1]
    std::vector<int32_t> blockCount;
    std::vector<PairBlock<Real>> blocks;
    std::deque<Vector> krylov;
    mutable std::vector<double> partial;
};

} // namespace PSE

#endif
