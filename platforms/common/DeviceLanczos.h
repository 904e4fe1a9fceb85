// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICELANCZOS_H_
#define OPENMMPSE_DEVICELANCZOS_H_

#include "DevicePlaces.h"
#include "StepSummary.h"
#include "numerics/Lanczos.h"
#include "numerics/Noise.h"
#include <functional>

namespace PSE {

/**
 * The Lanczos process on a device [T18], by kernels/lanczos.cc in a program that says whose square
 * root it draws. Vectors by place, mobilities in units of 1/(6 pi eta a).
 */
class DeviceLanczos {
public:
    /** Launch the kernel expandBasis: arguments of the matrix, then these. */
    using Expand = std::function<void(DeviceKernel& expandBasis, int iteration,
                                      OpenMM::ComputeArray& basis, OpenMM::ComputeArray& partial)>;
    /** @param kind  of the process: that of the tolerances, and how many iterations there may be */
    DeviceLanczos(OpenMM::ComputeContext& context, DevicePlaces& places, StepSummary& summary,
                  double tolerance, double negativeTolerance, const numerics::LanczosKind& kind);
    /** Rows of the StepSummary's sums that a process may use. */
    static int summaryRows(const numerics::LanczosKind& kind) {
        return 2 * kind.mostIterations + 1;
    }
    /** What the program must define: room for factors of so many vectors. */
    static Defines defines(const numerics::LanczosKind& kind) {
        return {{"MOST_VECTORS", std::to_string(kind.mostIterations)}};
    }
    void use(const OpenMM::ComputeProgram& program, Expand expand);
    /**
     * Of a program of a MIXTURE, before the first start().
     * @param kinds   of radii, by place
     * @param scales  D^{1/2} of each kind [T55]
     */
    void scaleBy(OpenMM::ComputeArray& kinds, OpenMM::ComputeArray& scales) {
        kindsOfPlaces = &kinds;
        scalesOfKinds = &scales;
    }

    /**
     * Draw z and run as many iterations as were needed last, without waiting for them.
     * @return rows of sums that the summary must be asked for
     */
    int start(const numerics::NoiseKey& key);
    /**
     * u += amplitude M^{1/2} z, after the summary was read; runs more iterations if needed.
     * @throws std::runtime_error for an indefinite M, or without convergence
     */
    void add(double amplitude, OpenMM::ComputeArray& u);
    int lastIterations() const { return iterations; }

private:
    void iterate(int from, int to);

    OpenMM::ComputeContext& context;
    DevicePlaces& places;
    StepSummary& summary;
    double tolerance, negativeTolerance;
    numerics::LanczosKind kind;
    bool reorthogonalise;
    OpenMM::ComputeArray coefficients, overlaps;
    OpenMM::ComputeArray *kindsOfPlaces = nullptr, *scalesOfKinds = nullptr;
    GrowingArray basis;
    Expand expand;
    DeviceKernel drawNoise, expandBasis, makeOrthogonal, findOverlaps, removeOverlaps, combineBasis;
    numerics::NoiseKey noise = {};
    int iterations = 0; ///< of the last square root
    int done = 0;       ///< of this one so far
};

/** The key as kernels take it. */
OpenMM::mm_int4 kernelKey(const numerics::NoiseKey& key);

} // namespace PSE

#endif
