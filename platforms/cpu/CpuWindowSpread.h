// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUWINDOWSPREAD_H_
#define OPENMMPSE_CPUWINDOWSPREAD_H_

#include "CpuSpread.h"
#include "GridKernels.h"
#include "numerics/Plan.h"

namespace PSE {

/** Equal spheres: the Kaiser-Bessel window, a product over the axes [T9]. */
template <class Real> class CpuWindowSpread : public CpuSpread<Real> {
public:
    explicit CpuWindowSpread(const numerics::Plan& plan);
    static double bytesPerParticle(const numerics::Plan& plan);
    void begin(int particles) override;
    void assign(const std::vector<numerics::Vec3>& fractions, int from, int to) override;
    void place(const std::vector<numerics::Vec3>& fractions, int from, int to) override;
    void spreadPlanes(int x, int number, Real* const planes[3]) const override;

protected:
    void gather(const Real* const grids[3], int from, int to) override;

private:
    using Base = CpuSpread<Real>;
    using Base::padded, Base::size, Base::rowLength, Base::planeLength, Base::order,
        Base::columnStart, Base::first, Base::sorted;
    GridParticles<Real> particles() const;
    int windowStart(double u) const;
    int wrapped(int d, int i) const { return i < 0 ? i + size[d] : i; }

    GridKernels<Real> loops = gridKernels<Real>();
    int support, windowDegree;
    std::vector<Real> windowCoefficients, weights;
};

} // namespace PSE

#endif
