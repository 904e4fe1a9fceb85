// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEKERNEL_H_
#define OPENMMPSE_DEVICEKERNEL_H_

#include "openmm/common/ArrayInterface.h"
#include "openmm/common/ComputeContext.h"
#include "openmm/common/ComputeVectorTypes.h"
#include <algorithm>
#include <string>

namespace PSE {

/** Threads of a work group; a power of two, and what the blocks of waveSpace.cc are made for. */
constexpr int GROUP_SIZE = 256;

/** An argument that the kernel declares as real, or as mixed, whatever the precision. */
struct Real {
    double value;
};
struct Mixed {
    double value;
};
/** Four of them as one vector. */
struct Real4 {
    double x, y, z, w;
};
struct Mixed4 {
    double x, y, z, w;
};

inline bool realIsDouble(const OpenMM::ComputeContext& context) {
    return context.getUseDoublePrecision();
}
inline bool mixedIsDouble(const OpenMM::ComputeContext& context) {
    return context.getUseDoublePrecision() || context.getUseMixedPrecision();
}
inline int realSize(const OpenMM::ComputeContext& context) {
    return realIsDouble(context) ? sizeof(double) : sizeof(float);
}
inline int mixedSize(const OpenMM::ComputeContext& context) {
    return mixedIsDouble(context) ? sizeof(double) : sizeof(float);
}

/** Groups that a launch of so many threads has: kernels loop over what is left. */
inline int groupsFor(const OpenMM::ComputeContext& context, int threads) {
    return std::max(
        1, std::min((threads + GROUP_SIZE - 1) / GROUP_SIZE, context.getNumThreadBlocks()));
}

/** A kernel that is called like a function, arguments in the order of its declaration. */
class DeviceKernel {
public:
    DeviceKernel() = default;
    DeviceKernel(OpenMM::ComputeContext& context, const OpenMM::ComputeProgram& program,
                 const std::string& name)
        : context(&context), kernel(program->createKernel(name)) {}

    template <class... Arguments> void operator()(int threads, Arguments&&... arguments) {
        for (; numArguments < int(sizeof...(arguments)); numArguments++)
            kernel->addArg();
        int index = 0;
        (set(index++, arguments), ...);
        kernel->execute(groupsFor(*context, threads) * GROUP_SIZE, GROUP_SIZE);
    }

private:
    void set(int index, OpenMM::ArrayInterface& array) { kernel->setArg(index, array); }
    void set(int index, int value) { kernel->setArg(index, value); }
    void set(int index, const OpenMM::mm_int4& value) { kernel->setArg(index, value); }
    void set(int index, const Real& real) { setNumber(index, real.value, realIsDouble(*context)); }
    void set(int index, const Mixed& m) { setNumber(index, m.value, mixedIsDouble(*context)); }
    void set(int index, const Real4& v) { setVector(index, v, realIsDouble(*context)); }
    void set(int index, const Mixed4& v) { setVector(index, v, mixedIsDouble(*context)); }
    void setNumber(int index, double value, bool isDouble) {
        if (isDouble)
            kernel->setArg(index, value);
        else
            kernel->setArg(index, static_cast<float>(value));
    }
    template <class Vector> void setVector(int index, const Vector& v, bool isDouble) {
        if (isDouble)
            kernel->setArg(index, OpenMM::mm_double4(v.x, v.y, v.z, v.w));
        else
            kernel->setArg(index,
                           OpenMM::mm_float4(float(v.x), float(v.y), float(v.z), float(v.w)));
    }

    OpenMM::ComputeContext* context = nullptr;
    OpenMM::ComputeKernel kernel;
    int numArguments = 0;
};

} // namespace PSE

#endif
