// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_SPLIT_H_
#define OPENMMPSE_NUMERICS_SPLIT_H_

// The positive split of the mobility, M = M_W + M_R [T4, T5]:
//
//     M_W(k) = 1/(eta V k^2) w(k) (I - kk),    0 <= w(k) <= sinc^2(k a)
//
// A split is its wave weight w. What is left for real space, M_R = RPY - (integral of M_W over all
// k), follows by quadrature for every distance, overlaps included: no closed form is needed, and
// none cancels.
//
// Everything here is in reduced units: lengths in radii a, wave numbers in 1/a, mobilities in 1/(6
// pi eta a).

#include "numerics/Rpy.h"
#include <string>
#include <vector>

namespace PSE::numerics {

/**
 * Scalars of an isotropic pair tensor written F I + C r r^T, r not normalised: C = (G - F)/r^2
 * stays finite at r = 0.
 */
struct SmoothScalars {
    double F, C;
};

class Split {
public:
    virtual ~Split() = default;
    virtual std::string name() const = 0;
    /** Wave weight w(k) for k >= 0. */
    virtual double waveWeight(double k) const = 0;

    /**
     * Wave part of the pair tensor in infinite fluid, (3/pi) Int w(k) [..] dk [T6], for 0 <= r <=
     * maxDistance(). Absolute error 1e-12 (F) by Gauss-Legendre quadrature.
     */
    SmoothScalars waveScalars(double r) const;
    /** Real part of the pair tensor, RPY minus wave part [T7], for 0 <= r <= maxDistance(). */
    PairScalars realScalars(double r) const;
    /** Real part of the self mobility, 1 - F_W(0) [T7]. */
    double realSelf() const { return 1 - waveScalars(0).F; }
    /** Largest distance the quadrature resolves; the real part is below its error there. */
    double maxDistance() const { return largestDistance; }

    /**
     * Root mean square error of M f, for unit random forces at volume fraction phi, caused by
     * dropping all wave numbers above kMax [T12].
     */
    double waveTruncation(double kMax, double phi) const;
    /** Smallest wave number above which waveTruncation() is at most error. */
    double waveCutoff(double error, double phi) const;
    /**
     * Error of M f, for unit forces, caused by dropping all pairs beyond rc [T13]: the root mean
     * square for random forces, and what adds up if all forces are alike.
     * @param phi      volume fraction around a particle
     * @param meanPhi  that of the whole box: like forces in a dense cluster add up in M f itself,
     * too
     */
    double realTruncation(double rc, double phi, double meanPhi) const;
    double realTruncation(double rc, double phi) const { return realTruncation(rc, phi, phi); }
    /**
     * Smallest distance (>= 2, beyond overlap) above which realTruncation() is at most error.
     */
    double realCutoff(double error, double phi, double meanPhi) const;
    double realCutoff(double error, double phi) const { return realCutoff(error, phi, phi); }

protected:
    /**
     * To be called by the constructor of a derived class.
     * @param kMax   w is negligible (below 1e-17) beyond
     * @param range  the real part is negligible beyond
     */
    void prepare(double kMax, double range);

private:
    void prepareTails();

    double largestWaveNumber = 0, largestDistance = 0;
    std::vector<double> waveNumbers, weights;
    /**
     * From tailDistance(i) to infinity: Int 4 pi r^2 (2 F^2 + G^2)/3 dr and Int 4 pi r^2 |2 F +
     * G|/3 dr.
     */
    std::vector<double> randomTail, coherentTail;
    double tailDistance(int i) const;
};

/**
 * The published split, w = sinc^2(k a) (1 + k^2/4xi^2) exp(-k^2/4xi^2) [T8] (Hasimoto 1959; Fiore
 * et al. 2017, eq. (9)).
 */
class HasimotoSplit : public Split {
public:
    /** @param xi  splitting parameter times radius, > 0 */
    explicit HasimotoSplit(double xi);
    std::string name() const override { return "Hasimoto"; }
    double waveWeight(double k) const override;

private:
    double xi;
};

} // namespace PSE::numerics

#endif
