// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUFREEDRAINING_H_
#define OPENMMPSE_CPUFREEDRAINING_H_

#include "MobilityEngine.h"
#include "Threads.h"
#include "WaveKernels.h"

namespace PSE {

/** ReferenceFreeDraining [T2] by threads and SIMD loops: noise is nearly all there is to compute.
 */
class CpuFreeDraining : public MobilityEngine {
public:
    CpuFreeDraining(double viscosity, const std::vector<double>& radii,
                    const std::vector<int>& indices, OpenMM::ThreadPool& pool, StageClock& clock);
    void setPositions(const std::vector<numerics::Vec3>&) override {}
    void computeVelocities(const std::vector<numerics::Vec3>* forces, const Thermal* thermal,
                           std::vector<numerics::Vec3>& u) override;
    int lanczosIterations() const override { return 0; }

private:
    std::vector<double> mobility, root; ///< 1/(6 pi eta a_i), and its square root
    std::vector<uint32_t> particles;    ///< indices in the System
    Threads threads;
    WaveKernels<double> noiseLoops = waveKernels<double>();
    StageClock& clock;
};

} // namespace PSE

#endif
