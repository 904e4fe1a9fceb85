// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUREALSPACE_H_
#define OPENMMPSE_CPUREALSPACE_H_

#include "CpuMixturePairs.h"
#include "KrylovVectors.h"
#include "numerics/Lattice.h"
#include "numerics/Plan.h"
#include "numerics/Vec3.h"
#include <memory>
#include <vector>

namespace PSE {

/**
 * The real-space half as a sparse matrix of 3x3 blocks [T7]. Neighbours are found anew for all
 * positions by a search over cells: Brownian steps are so long that a list with a skin would
 * hardly outlive one. Everything depends on the current positions alone, not on earlier ones nor
 * on threads. Mobilities in units of 1/(6 pi eta a).
 *
 * Vectors hold three numbers for each place: particles are sorted by cells, so that neighbours lie
 * close in memory.
 */
template <class Real> class CpuRealSpace : public KrylovVectors<Real> {
public:
    using typename KrylovVectors<Real>::Vector;

    CpuRealSpace(const numerics::Plan& plan, const numerics::Lattice& box, const Threads& threads);
    /** Bytes per particle and neighbour. */
    static constexpr double BYTES_PER_PAIR = double(sizeof(PairBlock<Real>)) / PAIR_LANES;
    /** Per particle: half a block unused, ten vectors, places, and its radius in a mixture. */
    static double bytesPerParticle(const numerics::Plan& plan);
    /** Another box with the same Plan; positions must be set anew. */
    void setBox(const numerics::Lattice& box);
    /** @param fractions  coordinates along the box vectors, in [0, 1) */
    void setPositions(const std::vector<numerics::Vec3>& fractions);
    // The same in parts: those of placeParticles(), then
    void begin(int particles);
    void assign(const std::vector<numerics::Vec3>& fractions, int from, int to);
    void sort();
    void place(const std::vector<numerics::Vec3>& fractions, int from, int to);
    void findNeighbours(const std::vector<numerics::Vec3>& fractions);
    /** The particle at each place. */
    const std::vector<int>& order() const { return particleAt; }

    /**
     * Of a mixture, what the vectors of M_R are to be multiplied by, at each place, before and
     * after its products, which are those of the scaled matrix X [T55]; else NULL: X is M_R.
     */
    const Real* scales() const { return mixture ? mixture->scales() : nullptr; }
    /** An error of M_R is in X at most this many times as large. */
    double errorGrowth() const { return mixture ? mixture->errorGrowth() : 1; }
    /** out = s X v + t w. @return v . out */
    double multiplyAdd(const Vector& v, double s, const Vector& w, double t, Vector& out) const;

private:
    void prepareCells(int particles);
    void fillRowsOf(int task, int thread, const std::vector<numerics::Vec3>& fractions);
    int findRuns(const numerics::Vec3& s, double share, PairRun* runs) const;
    void fillRowsWithImages(const std::vector<numerics::Vec3>& fractions);
    PairPolynomials<Real> polynomials() const;
    PairGeometry<Real> geometry() const;
    PairRows<Real> rows(int task) const;

    using KrylovVectors<Real>::threads;
    using KrylovVectors<Real>::kernels;

    numerics::Lattice box;
    double a, range;
    bool sumImages, tilted;
    bool rpy = true; ///< its branches are added to the polynomials
    double width[3]; ///< distances between opposite faces of the box
    /// |x|^2 >= h^T Q h by the coordinates h of x along the first two box vectors: Q_00, Q_01, Q_11
    double planeMetric[3];
    std::unique_ptr<CpuMixturePairs<Real>> mixture; ///< NULL for equal radii
    Real self = 0;                                  ///< of equal radii
    std::vector<Real> coefficientsF, coefficientsC;
    double reach[3];  ///< of the range, in fractions of the box
    int cellCount[3]; ///< cells along the box vectors
    /// along the first two, in coordinates along box vectors if the box is tilted, else in nm
    double cellSize[2];
    std::vector<int> particleAt, cellOf, cellStart;
    std::vector<typename PairCoordinate<Real>::Type> axes[3];
    std::vector<std::vector<PairBlock<Real>>> blocks; ///< one array per task of Threads::runBlocks
    std::vector<int32_t> rowStart, rowCount;          ///< [n], in the blocks of the row's task
    /** Room for candidates, of one thread. */
    struct Candidates {
        std::vector<int32_t> found;
        std::vector<Real> dx, dy, dz;
        PairScratch<Real> room(size_t count);
    };
    std::vector<Candidates> candidateRoom; ///< one per thread
};

} // namespace PSE

#endif
