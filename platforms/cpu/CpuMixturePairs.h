// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUMIXTUREPAIRS_H_
#define OPENMMPSE_CPUMIXTUREPAIRS_H_

#include "MixturePairKernels.h"
#include "numerics/MixtureTable.h"
#include "numerics/Plan.h"
#include <vector>

namespace PSE {

/**
 * Real-space pairs of unequal radii [T26]: who is a neighbour of whom, and the blocks of each row.
 * Lengths in radii of the Plan.
 */
template <class Real> class CpuMixturePairs {
public:
    /** @param threads  how many call fillRow() and evaluateRow() at once */
    CpuMixturePairs(const numerics::Plan& plan, int threads);
    static double bytesPerParticle();
    void begin(int particles);
    /** @param particleAt  the particle at each place */
    void place(const std::vector<int>& particleAt, int from, int to);

    /** Of the pairs of the particle at place i. */
    double largestRange(int i) const { return double(reach[i]) + largestReach; }
    double range(int i, int j) const { return double(reach[i]) + double(reach[j]); }
    /** Diagonal blocks, by place. */
    const Real* selves() const { return self.data(); }
    /** What M_R is scaled by on both sides, by place: its rows are those of the scaled one [T55].
     */
    const Real* scales() const { return scale.data(); }
    /** See MixtureScales. */
    double errorGrowth() const { return growth; }
    /** See PairKernels::fillRow(). */
    int fillRow(int thread, const PairGeometry<Real>& geometry, int i, const PairRun* runs,
                int numRuns, const PairScratch<Real>& scratch, PairBlock<Real>* row);
    /** See PairKernels::evaluateBlocks(). */
    void evaluateRow(int thread, int i, int count, int last, PairBlock<Real>* row);

private:
    void makeClasses(const numerics::MixtureTable& table);
    void makeBasis(const numerics::MixtureTable& table, const std::vector<double>& radii);
    MixturePairs<Real> pairs() const;
    MixtureRow<Real> rowOf(int thread, int i);

    MixturePairKernels<Real> kernels = mixturePairKernels<Real>();
    double rc, largestReach, growth;
    int degree, basis; ///< see MixturePairs
    /// of each distinct radius, MIXTURE_CLASSES at least; self of the scaled M_R
    std::vector<Real> radiusOf, reachOf, selfOf, scaleOf, inverseOf, curvatureOf;
    std::vector<int32_t> kindOf; ///< of each particle
    /// of few radii: [radius][F, C][degree + 1][MIXTURE_CLASSES]; of many: [m][F, C][degree +
    /// 1][basis], to be combined for each row
    std::vector<Real> functions;
    std::vector<Real> weights;            ///< [distinct radii][basis]
    std::vector<std::vector<Real>> rows;  ///< [thread] room for a row's own functions
    std::vector<Real> reach, self, scale; ///< by place
    std::vector<int32_t> kind;
};

} // namespace PSE

#endif
