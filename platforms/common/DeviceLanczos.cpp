// SPDX-License-Identifier: MIT
#include "DeviceLanczos.h"
#include <cmath>
#include <cstdint>

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

namespace {
constexpr int FIRST_ITERATIONS = 5; ///< of a first step
} // namespace

mm_int4 kernelKey(const NoiseKey& key) {
    return mm_int4(static_cast<int>(key.seed), static_cast<int>(key.stream),
                   static_cast<int>(uint32_t(key.counter)),
                   static_cast<int>(uint32_t(key.counter >> 32)));
}

DeviceLanczos::DeviceLanczos(ComputeContext& context, DevicePlaces& places, StepSummary& summary,
                             double tolerance, double negativeTolerance, const LanczosKind& kind)
    : context(context), places(places), summary(summary), tolerance(tolerance),
      negativeTolerance(negativeTolerance), kind(kind),
      reorthogonalise(realIsDouble(context) || kind.many) {
    if (reorthogonalise)
        overlaps.initialize(context, kind.mostIterations * groupsFor(context, places.count()),
                            mixedSize(context), "pseOverlaps");
    coefficients.initialize(context, kind.mostIterations, realSize(context), "pseCoefficients");
}

void DeviceLanczos::use(const ComputeProgram& program, Expand how) {
    expand = std::move(how);
    drawNoise = DeviceKernel(context, program, "drawNoise");
    expandBasis = DeviceKernel(context, program, "expandBasis");
    makeOrthogonal = DeviceKernel(context, program, "makeOrthogonal");
    findOverlaps = DeviceKernel(context, program, "findOverlaps");
    removeOverlaps = DeviceKernel(context, program, "removeOverlaps");
    combineBasis = DeviceKernel(context, program, "combineBasis");
}

int DeviceLanczos::start(const NoiseKey& key) {
    noise = key;
    done = 0;
    const int expected = iterations > 0 ? iterations : FIRST_ITERATIONS;
    basis.reserve(context, size_t(expected + 1) * places.count(), 4 * realSize(context),
                  "pseBasis");
    const auto draw = [&](auto&... scaling) {
        drawNoise(places.count(), places.count(), kernelKey(noise), places.places(), *basis,
                  summary.partialSums(), scaling...);
    };
    if (kindsOfPlaces != nullptr)
        draw(*kindsOfPlaces, *scalesOfKinds);
    else
        draw();
    iterate(0, expected);
    return 2 * expected + 1;
}

void DeviceLanczos::iterate(int from, int to) {
    for (int i = from; i < to; i++) {
        expand(expandBasis, i, *basis, summary.partialSums());
        const int n = places.count();
        makeOrthogonal(n, n, i, *basis, summary.partialSums());
        if (reorthogonalise) {
            findOverlaps(n, n, i, *basis, overlaps);
            removeOverlaps(n, n, i, *basis, overlaps, summary.partialSums());
        }
    }
    done = to;
}

void DeviceLanczos::add(double amplitude, ComputeArray& u) {
    LanczosTridiagonal small(tolerance, negativeTolerance, kind);
    const auto norm = [this](int i) { return std::sqrt(summary.sum(2 * i)); };
    for (bool finished = false; !finished;) {
        const int i = small.iterations();
        if (i == done) {
            const size_t needed = size_t(done + 2) * places.count();
            if (basis.size() < needed) { // more room loses what there is: the same once more
                iterations = std::min(done + 1 + done / 2, kind.mostIterations);
                start(noise);
            } else
                iterate(done, done + 1);
            summary.read(2 * done + 1);
        }
        if (norm(0) == 0)
            return;
        finished = small.add(summary.sum(2 * i + 1) / norm(i), norm(i + 1));
    }
    iterations = small.iterations();
    std::vector<double> weights(coefficients.getSize(), 0.0);
    for (int i = 0; i < iterations; i++)
        weights[i] = amplitude * norm(0) * small.coefficients()[i] / norm(i);
    coefficients.upload(weights, true);
    combineBasis(places.count(), places.count(), iterations, *basis, coefficients, u);
}

} // namespace PSE
