// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUUNBOUNDED_H_
#define OPENMMPSE_CPUUNBOUNDED_H_

#include "CpuAllPairs.h"
#include "ForceUnit.h"
#include "MobilityEngine.h"
#include "WaveKernels.h"

namespace PSE {

/**
 * The mobility of an unbounded fluid on the CPU, in arrays of Real. Inside, forces are scaled by
 * the largest of them (or by the force whose Stokes velocity is the thermal one), lengths by the
 * radius: any unit system fits single precision.
 */
template <class Real> class CpuUnbounded : public MobilityEngine {
public:
    /// at most, beside Krylov vectors and the bounded record of pairs
    static constexpr double BYTES_PER_PARTICLE =
        CpuAllPairs<Real>::BYTES_PER_PARTICLE + 9 * sizeof(Real) + sizeof(numerics::Vec3);
    /** @param radii  of the mobile particles (nm) */
    CpuUnbounded(const numerics::UnboundedPlan& plan, const std::vector<double>& radii,
                 double viscosity, const std::vector<int>& indices, OpenMM::ThreadPool& pool,
                 StageClock& clock);
    void setPositions(const std::vector<numerics::Vec3>& x) override;
    void computeVelocities(const std::vector<numerics::Vec3>* forces, const Thermal* thermal,
                           std::vector<numerics::Vec3>& u) override;
    int lanczosIterations() const override { return iterations; }

private:
    using Vector = AlignedVector<Real>;
    void addVelocities(const ForceUnit& scale, const std::vector<numerics::Vec3>* forces,
                       const Thermal* thermal, std::vector<numerics::Vec3>& u);
    void multiply(const std::vector<numerics::Vec3>& forces, double unit);
    void drawNoise(const Thermal& thermal);

    numerics::UnboundedPlan plan;
    double drag; ///< 6 pi eta a
    std::vector<int> indices;
    Threads threads;
    StageClock& clock;
    CpuAllPairs<Real> pairs;
    WaveKernels<Real> noiseLoops = waveKernels<Real>();
    Vector forced, random, drawn; ///< drawn: [n][3]
    int iterations = 0;
};

} // namespace PSE

#endif
