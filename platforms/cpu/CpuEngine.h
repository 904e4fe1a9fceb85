// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUENGINE_H_
#define OPENMMPSE_CPUENGINE_H_

#include "CpuRealSpace.h"
#include "CpuWaveSpace.h"
#include "ForceUnit.h"
#include "MobilityEngine.h"
#include <optional>

namespace PSE {

/**
 * The periodic mobility on the CPU, in arrays of Real. Inside, forces are scaled by the largest of
 * them (or by the force whose Stokes velocity is the thermal one), lengths by the radius: any unit
 * system fits single precision.
 */
template <class Real> class CpuEngine : public MobilityEngine {
public:
    CpuEngine(const numerics::Plan& plan, const numerics::Lattice& box, double viscosity,
              const std::vector<int>& indices, OpenMM::ThreadPool& pool, StageClock& clock);
    void setBox(const numerics::Lattice& box) override;
    void setPositions(const std::vector<numerics::Vec3>& x) override;
    void computeVelocities(const std::vector<numerics::Vec3>* forces, const Thermal* thermal,
                           std::vector<numerics::Vec3>& u) override;
    int lanczosIterations() const override { return iterations; }

private:
    using Vector = AlignedVector<Real>;
    void setVelocities(const ForceUnit& scale, const std::vector<numerics::Vec3>* forces,
                       const Thermal* thermal, std::vector<numerics::Vec3>& u);
    void takeForces(const std::vector<numerics::Vec3>& forces, double unit);
    void multiplyReal(const std::vector<numerics::Vec3>& forces, double unit);
    void drawReal(const Thermal& thermal);
    void writeReal(bool forced, Real noise, double unit, std::vector<numerics::Vec3>& u) const;

    double drag; ///< 6 pi eta a
    double lanczosTolerance, negativeTolerance = 0;
    bool reorthogonalise;
    std::vector<int> indices;
    numerics::Lattice box;
    Threads threads;
    StageClock& clock;
    std::optional<CpuRealSpace<Real>> realSpace; ///< none where waves are all there is
    CpuWaveSpace<Real> waveSpace;
    WaveKernels<Real> noiseLoops = waveKernels<Real>();
    std::vector<numerics::Vec3> fractions;
    Vector realForced, realThermal; ///< [n][3] by place of the real-space half
    int iterations = 0;
};

} // namespace PSE

#endif
