// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUALLPAIRS_H_
#define OPENMMPSE_CPUALLPAIRS_H_

#include "AllPairsKernels.h"
#include "KrylovVectors.h"
#include "numerics/UnboundedPlan.h"
#include "numerics/Vec3.h"
#include <vector>

namespace PSE {

/**
 * The mobility of an unbounded fluid as a sum over all pairs [T32]. The first of several products
 * at the same positions keeps the two scalars of each pair for the others, which take less than
 * half its time [T57]; beyond MOST_RECORDED bytes every product evaluates them anew. Mobilities in
 * units of 1/(6 pi eta a), lengths in a, the plan's radius. Vectors are three arrays, one per
 * component, of stride() places in the order of the particles; those beyond the last particle hold
 * zeros.
 *
 * Rows of pairs are divided into slabs, as many as the number of particles says, and each slab adds
 * up what it finds in an order and at a place of its own: the sum of all is the same for any number
 * of threads.
 */
template <class Real> class CpuAllPairs : public KrylovVectors<Real> {
public:
    using typename KrylovVectors<Real>::Vector;
    /// Slabs, and so tasks of threads: enough for many threads, and short sums in single precision;
    /// few for memory, and for the time it takes to add them up.
    static constexpr int PARTICLES_PER_SLAB = 100, MOST_SLABS = 64;
    /// beside the record of pairs
    static constexpr double BYTES_PER_PARTICLE = (3 * MOST_SLABS + 8) * sizeof(Real);

    /** @param radii  of the particles (nm) */
    CpuAllPairs(const numerics::UnboundedPlan& plan, const std::vector<double>& radii,
                const Threads& threads);
    /** @param x  positions (nm) */
    void setPositions(const std::vector<numerics::Vec3>& x);
    int stride() const { return padded; }
    /** Whether more products at these positions will follow the next one. */
    void expectMore(bool more) { keepsRecord = more && mayRecord; }
    /** out = s M v + t w. @return v . out */
    double multiplyAdd(const Vector& v, double s, const Vector& w, double t, Vector& out) const;

private:
    static int slabsFor(int particles);
    void divideRows();
    double addSlabs(int from, int to, const Vector& v, double s, const Vector& w, double t,
                    Vector& out) const;

    using KrylovVectors<Real>::kernels;
    using KrylovVectors<Real>::threads;

    double a;
    double farthestNear; ///< from the middle, in a: there the rests of coordinates may be left out
    int count, padded;
    AllPairsKernels<Real> loops;
    Vector gaussianF, gaussianC;         ///< of force coupling, an even number of terms
    Vector radius, self;                 ///< radius over a, and its inverse
    Vector places[3], rests[3];          ///< coordinates, and what single precision leaves of them
    std::vector<int> firstRow;           ///< of each slab; the last is `count`
    mutable std::vector<Vector> sums;    ///< one per slab, like a vector
    mutable std::vector<Vector> records; ///< F and C of the pairs of each slab
    bool mayRecord, keepsRecord = false, isNear = false;
    mutable bool recorded = false; ///< at these positions
};

} // namespace PSE

#endif
