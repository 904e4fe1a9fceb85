// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_MIXTURE_H_
#define OPENMMPSE_NUMERICS_MIXTURE_H_

#include "numerics/Envelope.h"
#include "numerics/Split.h"
#include <memory>
#include <string>
#include <vector>

namespace PSE::numerics {

/**
 * Spheres of unequal radii and the positive split of their mobility [T25],
 *
 *     M_W,ij(k) = 1/(eta V k^2) H(k) sinc(k ai) sinc(k aj) (I - kk),
 *
 * M_R,ij what is left for real space. Lengths in the unit Plan::a, mobilities in 1/(6 pi eta a).
 */
class Mixture {
public:
    /**
     * @param radii  of all particles that feel the fluid, in their order
     * @param cut    by which every pair ends before the real half has faded, below
     * Envelope::range()
     */
    Mixture(std::shared_ptr<const Envelope> envelope, const std::vector<double>& radii,
            double cut = 0);

    std::string name() const { return H->name(); }
    /** Of each particle. */
    const std::vector<double>& particleRadii() const { return ofParticles; }
    /** The distinct ones, ascending. */
    const std::vector<double>& radii() const { return distinct; }

    /** H(k), the share of the wave half: zero from largestWaveNumber() on. */
    double envelope(double k) const { return (*H)(k); }
    double largestWaveNumber() const { return H->largestWaveNumber(); }
    double waveWeight(double k, double ai, double aj) const;
    const Envelope& shape() const { return *H; }

    /** range(ai, aj) = reach(ai) + reach(aj): beyond, M_R,ij is left out. */
    double reach(double a) const { return 0.5 * pointRange + a; }
    double range(double ai, double aj) const { return pointRange + ai + aj; }
    /** Of two point forces. */
    double rangeOfPoints() const { return pointRange; }
    double largestRange() const { return range(distinct.back(), distinct.back()); }

private:
    std::shared_ptr<const Envelope> H;
    std::vector<double> ofParticles, distinct;
    double pointRange;
};

/**
 * The wave part of pairs in infinite fluid, (3/pi) Int H sinc(k ai) sinc(k aj) [..] dk [T6], by
 * Gauss-Legendre quadrature over the whole of H; error 1e-12 for r up to the distance asked for.
 */
class MixtureQuadrature {
public:
    MixtureQuadrature(const Mixture& mixture, double largestDistance);
    /** Radii within those of the mixture. */
    SmoothScalars operator()(double r, double ai, double aj) const { return at(r, of(ai, aj)); }
    /** The weights of one pair of radii, for many distances. */
    std::vector<double> of(double ai, double aj) const;
    SmoothScalars at(double r, const std::vector<double>& pair) const;
    const std::vector<double>& waveNumbers() const { return k; }
    /** (3/pi) H times the weights of the rule. */
    const std::vector<double>& weights() const { return w; }

private:
    std::vector<double> k, w;
};

/**
 * What makes the real half of unequal spheres well conditioned [T55]: its noise is
 * D^{1/2} X^{1/2} z with X = D^{-1/2} M_R D^{-1/2}, D the diagonal of M_R, or LEAST_SHARE of the
 * whole mobility 1/a where that is more.
 */
class MixtureScales {
public:
    static constexpr double LEAST_SHARE = 0.05;
    explicit MixtureScales(const Mixture& mixture);
    /** D^{1/2} of a radius of the mixture. */
    double operator()(double a) const;
    /**
     * An error of M_R, relative to the mobilities 1/a, is in X at most this many times as large:
     * the largest 1/(a D).
     */
    double errorGrowth() const { return growth; }

private:
    std::vector<double> k, w; ///< quadrature of the wave part's diagonal, (2/pi) Int H sinc^2 dk
    double growth = 1;
};

} // namespace PSE::numerics

#endif
