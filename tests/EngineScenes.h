// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_TESTS_ENGINESCENES_H_
#define OPENMMPSE_TESTS_ENGINESCENES_H_

// What the tests of the CPU engine share: velocities and their differences, and instruction sets.

#include "CpuRealSpace.h"
#include "numerics/Vec3.h"
#include <cmath>
#include <hwy/targets.h>
#include <vector>

namespace engineScenes {

inline double norm(const std::vector<PSE::numerics::Vec3>& u) {
    double sum = 0;
    for (const PSE::numerics::Vec3& v : u)
        sum += v.squaredNorm();
    return std::sqrt(sum);
}

inline double distance(std::vector<PSE::numerics::Vec3> u,
                       const std::vector<PSE::numerics::Vec3>& v) {
    for (size_t i = 0; i < u.size(); i++)
        u[i] -= v[i];
    return norm(u);
}

/** Restores what Highway would have chosen by itself. */
struct ChosenTarget {
    explicit ChosenTarget(int64_t target) { choose(target); }
    ~ChosenTarget() { choose(0); }
    static void choose(int64_t target) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    }
};

/** The single targets among those that this machine can run. */
inline std::vector<int64_t> runnableTargets() {
    std::vector<int64_t> targets;
    for (int64_t all = hwy::SupportedTargets(); all != 0; all &= all - 1)
        targets.push_back(all & -all);
    return targets;
}

/** M_R f at the positions set last. */
template <class Real>
std::vector<PSE::numerics::Vec3> realProduct(PSE::CpuRealSpace<Real>& space,
                                             const std::vector<PSE::numerics::Vec3>& forces) {
    const size_t n = forces.size();
    PSE::AlignedVector<Real> f(3 * n + 1), out(3 * n);
    const auto scale = [&](size_t place) { return space.scales() ? space.scales()[place] : 1; };
    for (size_t place = 0; place < n; place++)
        for (int c = 0; c < 3; c++)
            f[3 * place + c] = Real(forces[space.order()[place]][c]) * scale(place);
    space.multiplyAdd(f, 1, f, 0, out);
    std::vector<PSE::numerics::Vec3> u(n);
    for (size_t place = 0; place < n; place++)
        for (int c = 0; c < 3; c++)
            u[space.order()[place]][c] = out[3 * place + c] * scale(place);
    return u;
}

} // namespace engineScenes

#endif
