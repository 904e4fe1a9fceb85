// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUSPHERESPREAD_H_
#define OPENMMPSE_CPUSPHERESPREAD_H_

#include "CpuSpread.h"
#include "SphereKernels.h"
#include "numerics/Lattice.h"
#include "numerics/Plan.h"

namespace PSE {

/**
 * Unequal spheres: the radial window averaged over each particle's sphere, on one grid [T30, T31].
 * Weights are evaluated where they are used: the spheres of a mixture have too many of them to be
 * kept. Small spheres of a few radii have rows that are sums of a few products [T54].
 */
template <class Real> class CpuSphereSpread : public CpuSpread<Real> {
public:
    CpuSphereSpread(const numerics::Plan& plan, const numerics::Lattice& box,
                    const Threads& threads);
    static int paddingOf(const numerics::Plan& plan, const numerics::Lattice& box);
    static double bytesPerParticle(const numerics::Plan& plan);
    void setBox(const numerics::Lattice& box) override;
    void begin(int particles) override;
    void assign(const std::vector<numerics::Vec3>& fractions, int from, int to) override;
    void place(const std::vector<numerics::Vec3>& fractions, int from, int to) override;
    int planesTogether() const override { return PLANES_TOGETHER; }
    void spreadPlanes(int x, int number, Real* const planes[3]) const override;

protected:
    void gather(const Real* const grids[3], int from, int to) override;

private:
    /// What is found out about a sphere then serves several of its planes, and those of three grids
    /// still fit into the caches.
    static constexpr int PLANES_TOGETHER = 4;
    using Base = CpuSpread<Real>;
    using Base::padded, Base::size, Base::rowLength, Base::planeLength, Base::order,
        Base::columnStart, Base::first, Base::sorted;
    void makeShapes(const numerics::Plan& plan, const Threads& threads);
    void makeRows(const numerics::Plan& plan, const Threads& threads);
    GridSpheres<Real> spheres() const;
    double lowest(int shape, int d, double u) const;
    int wrapped(int d, int i) const;

    double a; ///< unit of lengths (nm)
    SphereKernels<Real> loops = sphereKernels<Real>();
    double pointsPerLength[3]; ///< how many grid points a sphere of radius 1 reaches to
    int degree = 0, widest = 0;
    Real plane, line, point, skewY, skewX, skewZ; ///< see GridSpheres
    std::vector<double> reach;                    ///< of each shape, in radii of the Plan
    std::vector<SphereShape<Real>> shapes;
    std::vector<Real> coefficients, offset;
    /// [T54] of each shape, 0: rows of it are no sums of a few products
    std::vector<Real> rowScale;
    int rowTerms = LEAST_ROW_TERMS, rowDegree = 0;
    std::vector<Real> across, along, alongWeights; ///< see GridSpheres
    std::vector<SphereChords> chords;              ///< of each place, where rows are such sums
    std::vector<int> shapeOf, placedShape;         ///< of each particle, and of each place
};

} // namespace PSE

#endif
