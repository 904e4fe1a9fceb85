// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEGEOMETRY_H_
#define OPENMMPSE_DEVICEGEOMETRY_H_

#include "DeviceArrays.h"
#include "DevicePrograms.h"
#include "numerics/Lattice.h"
#include "numerics/Plan.h"
#include "numerics/Vec3.h"

namespace PSE {

/// room for neighbours beyond their mean number: structure and fluctuations, then what is found
constexpr double ROOM = 1.5, MORE_ROOM = 1.2;
constexpr int LEAST_ROOM = 16;
constexpr double MOST_ROOM = 1e9;

/** A few reals that kernels read and that follow the box. */
class DeviceNumbers {
public:
    static constexpr int MOST = 16;
    DeviceNumbers(DevicePrograms& programs, const char* name);
    /** For launches from now on; nothing waits. @param values  at most MOST */
    void set(std::vector<double> values);
    OpenMM::ComputeArray& array() { return numbers; }

private:
    OpenMM::ComputeArray numbers;
    DeviceKernel setNumbers;
};

/** What kernels/displacement.cc calls geometry, lengths in `unit`; rows add what they need. */
std::vector<double> geometryOf(const OpenMM::ComputeContext& context, const numerics::Lattice& box,
                               double unit);
/**
 * Whether the nearest fractions are not always the nearest image: in this box, or in one that it
 * may become.
 */
bool mayBeTilted(const OpenMM::ComputeContext& context, const numerics::Plan& plan,
                 const numerics::Lattice& box);
/**
 * All lattice vectors within a range (nm), in `unit`; the fourth component is 0 for none.
 * @return their number
 */
int uploadImages(GrowingArray& array, OpenMM::ComputeContext& context, const numerics::Lattice& box,
                 double range, double unit);

} // namespace PSE

#endif
