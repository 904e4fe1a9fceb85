// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_PROLATESPLIT_H_
#define OPENMMPSE_NUMERICS_PROLATESPLIT_H_

#include "numerics/ProlateFunction.h"
#include "numerics/Split.h"
#include <vector>

namespace PSE::numerics {

/**
 * The matched prolate split [T19-T22]: w(k) = W(k) up to the first zero k0 of W, and 0 beyond,
 *
 *     W(k) = H0(k) - s k H0'(k),   H0(k) = psi(k R/c),   s = 1/2 (1 - 2 c^2/(m chi R^2)),
 *
 * psi the ProlateFunction of bandwidth c. W = 1 - k^2/m + O(k^4) as the weight of the whole
 * mobility, m = 3 for sinc^2 and pi for the Gaussian of force coupling, and its inverse Fourier
 * transform is zero beyond R: RPY minus the wave part of W is exactly zero beyond R, and force
 * coupling [T42] has its Gaussian tail there. What is dropped beyond k0 is the error that c
 * decides.
 */
class ProlateSplit : public Split {
public:
    /// what isPositive() demands
    static constexpr double LARGEST_ZERO = 3, SMALLEST_MATCHING = 0.05, SMALLEST_RANGE = 2.4;
    /// radii beyond which the tail of force coupling is below 1e-17
    static constexpr double LARGEST_TAIL = 7.2;
    /// radii within which polynomials in r^2 resolve the envelopes of force coupling, in single and
    /// in double precision
    static constexpr double SINGLE_RESOLVED = 7, DOUBLE_RESOLVED = 10;
    /// bandwidths that serve the tolerances of a Plan, 1e-1 to 1e-10
    static constexpr double SMALLEST_BANDWIDTH = 3, LARGEST_BANDWIDTH = 30;

    /**
     * @param bandwidth  c
     * @param range      R in radii, > 2
     */
    ProlateSplit(double bandwidth, double range,
                 SphereModel model = SphereModel::RotnePragerYamakawa);
    std::string name() const override { return "Prolate"; }
    double waveWeight(double k) const override;
    /** Of the unclipped W, in closed form [T20]; beyond R its far field, which is RPY itself or
     * that of force coupling. Absolute error 1e-13 up to c = 20, 1e-12 at 30. */
    SmoothScalars waveScalars(double r) const override;
    double maxDistance() const override;
    double tableRange(bool single) const override;
    using Split::realTruncation;
    double realTruncation(double rc, double phi, double meanPhi) const override;

    double bandwidth() const { return psi.bandwidth(); }
    double range() const { return R; }
    /** s, the share of the matching term. */
    double matching() const { return s; }
    /** k0, beyond which w is zero. */
    double firstZero() const { return k0; }
    /**
     * Whether w is at most the weight of the whole mobility for every k, to rounding, and the
     * estimates hold [T21, T42].
     */
    bool isPositive() const;

protected:
    DroppedWaves droppedWaves(double kMax) const override;
    DroppedWaves droppedWaves(const std::array<double, 3>& faces) const override;
    double largestWaveNumber() const override { return k0; }

private:
    double findZero() const;
    double pairsBeyondZero() const;

    ProlateFunction psi;
    double R, s, k0;
    EvenLegendreSeries slope, W;          ///< x psi' and W, in x = k R/c
    std::vector<double> seriesF, seriesC; ///< in (r/R)^2
    DroppedWaves beyond;                  ///< of W beyond k0
};

} // namespace PSE::numerics

#endif
