// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_REFERENCEENGINE_H_
#define OPENMMPSE_REFERENCEENGINE_H_

// The oracle: double precision, direct sums over pairs and over the wave vectors of the Plan; no
// window, no FFT, and Lanczos converged to 1e-12. Its cost grows as N times the number of modes:
// use it up to about 1000 particles.

#include "MobilityEngine.h"
#include "numerics/MixtureTable.h"
#include "numerics/RealTable.h"
#include <complex>

namespace PSE {

class ReferenceEngine : public MobilityEngine {
public:
    static constexpr double LANCZOS_TOLERANCE = 1e-12;

    ReferenceEngine(const numerics::Plan& plan, const numerics::Lattice& box, double viscosity,
                    const std::vector<int>& indices, StageClock& clock);
    void setBox(const numerics::Lattice& box) override;
    void setPositions(const std::vector<numerics::Vec3>& x) override;
    void computeVelocities(const std::vector<numerics::Vec3>* forces, const Thermal* thermal,
                           std::vector<numerics::Vec3>& u) override;
    int lanczosIterations() const override { return iterations; }

private:
    using Vectors = std::vector<numerics::Vec3>;
    struct Pair {
        int i, j;
        numerics::Vec3 d; ///< x_i - x_j in radii
        double F, C;      ///< M_R = F I + C d d^T
    };
    struct Mode {
        int n[3];
        numerics::Vec3 direction; ///< k/|k|
        double k;                 ///< in 1/a
        double B;                 ///< wave factor w/(eta V k^2); of a mixture without its sincs
    };

    void prepareRealHalf();
    /** Real-space scalars of a pair at a distance in units of a; false beyond its range. */
    bool realPair(int i, int j, double r, numerics::SmoothScalars& scalars) const;
    void listModes();
    void addPair(int i, int j, const numerics::Vec3& d);
    void listNeighbours();
    void listImages();
    void preparePhases();
    /** out = M_R v, in units of 1/(6 pi eta a). */
    void multiplyReal(const Vectors& v, Vectors& out) const;
    void multiplyScaled(const Vectors& v, Vectors& out) const;
    void addReal(const Vectors* forces, const Thermal* thermal, Vectors& u);
    void addWaves(const Vectors* forces, const Thermal* thermal, Vectors& u) const;
    std::complex<double> phase(int particle, const Mode& mode) const;

    numerics::Plan plan;
    numerics::Lattice box;
    double viscosity, selfMobility; ///< selfMobility: 1/(6 pi eta a)
    std::vector<int> indices;
    StageClock& clock;
    numerics::RealTable table;                                  ///< of equal spheres
    std::unique_ptr<const numerics::MixtureTable> mixtureTable; ///< of unequal ones
    std::vector<double> realSelf;                               ///< diagonal of M_R, by particle
    std::vector<double> scales;                                 ///< of a mixture, by particle [T55]
    double errorGrowth = 1;                                     ///< see MixtureScales
    std::vector<Mode> modes;                                    ///< one of each pair n, -n
    Vectors positions;                                          ///< in the primary box
    /// each unordered pair (and image) once; i == j for images of a particle itself
    std::vector<Pair> pairs;
    /** phases[d][particle*(2 R + 1) + R + n] = exp(i 2 pi n s_d), R = M_d/2. */
    std::vector<std::complex<double>> phases[3];
    int iterations = 0;
};

} // namespace PSE

#endif
