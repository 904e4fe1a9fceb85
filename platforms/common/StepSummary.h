// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_STEPSUMMARY_H_
#define OPENMMPSE_STEPSUMMARY_H_

#include "DeviceArrays.h"
#include "DevicePrograms.h"

namespace PSE {

/**
 * The one thing that the host reads in a step: maxima and sums over all particles, which the groups
 * of a launch over particles leave behind.
 */
class StepSummary {
public:
    /// as in kernels/reductions.cc
    enum Maximum { Force, Velocity, Neighbours, Unsorted, NUM_MAXIMA };

    /** @param sums  rows of sums that there is room for */
    StepSummary(DevicePrograms& programs, int particles, int sums);
    /** [NUM_MAXIMA][groups] reals, for kernels to write */
    OpenMM::ComputeArray& maxima() { return largest; }
    /** [sums][groups] mixed numbers, for kernels to write and read */
    OpenMM::ComputeArray& partialSums() { return partial; }
    /**
     * Wait for the device, and read the maxima and the first rows of sums.
     * @throws OpenMMException if the device has not sorted what it was given
     */
    void read(int sums);
    double maximum(Maximum which) const { return values[which]; }
    double sum(int row) const { return values[NUM_MAXIMA + row]; }

private:
    OpenMM::ComputeContext& context;
    int particles, groups;
    OpenMM::ComputeArray largest, partial, summary;
    DeviceKernel summarise;
    std::vector<double> values;
};

} // namespace PSE

#endif
