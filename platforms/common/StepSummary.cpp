// SPDX-License-Identifier: MIT
#include "StepSummary.h"
#include "DevicePrograms.h"
#include "openmm/OpenMMException.h"

namespace PSE {

StepSummary::StepSummary(DevicePrograms& programs, int particles, int sums)
    : context(programs.context()), particles(particles), groups(groupsFor(context, particles)) {
    largest.initialize(context, NUM_MAXIMA * groups, realSize(context), "pseLargest");
    partial.initialize(context, std::max(1, sums * groups), mixedSize(context), "psePartialSums");
    summary.initialize(context, NUM_MAXIMA + sums, mixedSize(context), "pseSummary");
    context.clearBuffer(largest);
    context.clearBuffer(partial);
    summarise = DeviceKernel(context, programs.particles(), "summarise");
}

void StepSummary::read(int sums) {
    summarise((NUM_MAXIMA + sums) * GROUP_SIZE, sums, groups, largest, partial, summary);
    summary.download(values, true);
    if (values[Unsorted] != 0)
        throw OpenMM::OpenMMException(
            "PSEBrownianIntegrator: the particles were not sorted on this device, 1 or more of " +
            std::to_string(particles) +
            " are out of order and 0 may be; update its driver, or use another platform");
}

} // namespace PSE
