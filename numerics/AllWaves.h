// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_ALLWAVES_H_
#define OPENMMPSE_NUMERICS_ALLWAVES_H_

#include "numerics/Split.h"

namespace PSE::numerics {

/**
 * Force coupling without a split: its weight exp(-k^2/pi) decays fast enough for waves alone, so
 * that nothing is left for real space, neither pairs nor noise [T43].
 */
class AllWaves : public Split {
public:
    AllWaves() : Split(SphereModel::ForceCoupling) {}
    std::string name() const override { return "AllWaves"; }
    double waveWeight(double k) const override { return forceCouplingWeight(k); }
    /** The whole tensor, at every distance. */
    SmoothScalars waveScalars(double r) const override { return forceCouplingSmooth(r, 1, 1); }
    double maxDistance() const override { return 0; }
    double tableRange(bool) const override { return 0; }
    using Split::realTruncation;
    double realTruncation(double, double, double) const override { return 0; }

protected:
    DroppedWaves droppedWaves(double kMax) const override {
        return kMax < END ? integrateWaves(kMax, END) : DroppedWaves{0, 0};
    }
    DroppedWaves droppedWaves(const std::array<double, 3>& faces) const override;
    double largestWaveNumber() const override { return END; }

private:
    static constexpr double END = 11.2; ///< exp(-k^2/pi) = 5e-18
};

} // namespace PSE::numerics

#endif
