// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_MIXTURETABLE_H_
#define OPENMMPSE_NUMERICS_MIXTURETABLE_H_

#include "numerics/Chebyshev.h"
#include "numerics/Mixture.h"
#include <vector>

namespace PSE::numerics {

/**
 * The real half of a mixture as a platform evaluates it [T26]: the RPY tensor of the pair minus a
 * smooth wave part, which is interpolated in both radii,
 *
 *     F_W(r; ai, aj) = sum_mn c_m(ai) c_n(aj) F_mn(t),   t = 2 r^2/rc^2 - 1,
 *
 * and C_W likewise; M_W = F_W I + C_W r r^T. A row of pairs of one particle i adds its own weights
 * first: sum_m c_m(ai) F_mn. All polynomials have one degree and one rc, the largest range; each
 * pair ends at its own range, Mixture::range().
 */
class MixtureTable {
public:
    /// distinct radii up to which each has a basis function of its own
    static constexpr int MOST_CLASSES = 8;

    /**
     * @param maxError  absolute error allowed to F and r^2 C, in units of the
     * mobility of the larger sphere of the pair
     * @throws std::invalid_argument if radii differ too much to be interpolated
     */
    MixtureTable(const Mixture& mixture, double maxError);

    double rc() const { return range; }
    /** Number of basis functions, at most MOST_BASIS. */
    int size() const { return static_cast<int>(nodes.size()); }
    static constexpr int MOST_BASIS = 32;
    int degree() const { return functionsF[0].degree(); }
    /** Whether radii between those of the basis are interpolated; else each has its own. */
    bool interpolates() const { return interpolated; }
    /** The radii of the basis functions: c_m is 1 at node m and 0 at the others. */
    const std::vector<double>& basisRadii() const { return nodes; }
    /** c_m(a), all m; a among or between the radii of the mixture. */
    std::vector<double> weights(double a) const;
    const Polynomial& F(int m, int n) const { return functionsF[m * size() + n]; }
    const Polynomial& C(int m, int n) const { return functionsC[m * size() + n]; }

    /** Diagonal of M_R: two equal spheres at one place have exactly no relative mobility. */
    double self(double a) const;
    /** Wave part, 0 <= r <= rc. */
    SmoothScalars waveScalars(double r, double ai, double aj) const;
    /**
     * Real-space scalars, M_R = F I + C r r^T; C = 0 at r = 0, where r r^T vanishes. The pair's
     * range is not looked at.
     */
    SmoothScalars operator()(double r, double ai, double aj) const;
    /**
     * By how much Horner's rule in powers of t magnifies rounding: the largest sum of the absolute
     * powers, relative to the mobility of the larger sphere.
     */
    double magnification() const { return magnified; }

private:
    void chooseNodes(const Mixture& mixture, const MixtureQuadrature& rule, double maxError);
    void fit(const Mixture& mixture, const MixtureQuadrature& rule, double maxError);
    void finish(int degree);

    double range, magnified = 0;
    bool interpolated = false;
    std::vector<double> nodes, barycentric;
    std::vector<Polynomial> functionsF, functionsC; ///< m * size() + n
};

} // namespace PSE::numerics

#endif
