// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_HASIMOTOSPLIT_H_
#define OPENMMPSE_NUMERICS_HASIMOTOSPLIT_H_

#include "numerics/Split.h"
#include <vector>

namespace PSE::numerics {

/**
 * The published split, w = sinc^2(k a) (1 + k^2/4xi^2) exp(-k^2/4xi^2) [T8] (Hasimoto 1959; Fiore
 * et al. 2017, eq. (9)). Its wave part follows by quadrature: no closed form is needed, and none
 * cancels.
 */
class HasimotoSplit : public Split {
public:
    /** @param xi  splitting parameter times radius, > 0 */
    explicit HasimotoSplit(double xi);
    std::string name() const override { return "Hasimoto"; }
    double waveWeight(double k) const override;
    /** Absolute error 1e-12 (F) by Gauss-Legendre quadrature. */
    SmoothScalars waveScalars(double r) const override;
    double maxDistance() const override { return largestDistance; }
    double tableRange(bool single) const override;
    using Split::realTruncation;
    double realTruncation(double rc, double phi, double meanPhi) const override;

protected:
    using Split::droppedWaves;
    DroppedWaves droppedWaves(double kMax) const override;
    double largestWaveNumber() const override { return kEnd; }

private:
    void prepareTails();
    double tailDistance(int i) const;

    double xi, kEnd, largestDistance;
    std::vector<double> waveNumbers, weights;
    /**
     * From tailDistance(i) to infinity: Int 4 pi r^2 (2 F^2 + G^2)/3 dr and Int 4 pi r^2 |2 F +
     * G|/3 dr.
     */
    std::vector<double> randomTail, coherentTail;
};

} // namespace PSE::numerics

#endif
