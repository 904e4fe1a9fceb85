// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_ENVELOPE_H_
#define OPENMMPSE_NUMERICS_ENVELOPE_H_

#include "numerics/ProlateFunction.h"
#include <string>

namespace PSE::numerics {

/**
 * The share H(k) of every wave that the wave half of a mixture takes, 0 <= H <= 1, the same for all
 * pairs [T25]: at each k the mobility is an outer product over the particles, and a part of it is
 * positive together with the rest only if it is proportional to the whole. 1 - H = O(k^4), so the
 * real half is of short range: that of point forces ends at R.
 *
 * Lengths in the unit of the Plan, wave numbers in its inverse.
 */
class Envelope {
public:
    explicit Envelope(double range) : R(range) {}
    virtual ~Envelope() = default;
    virtual std::string name() const = 0;
    /** H(k), k >= 0; zero from largestWaveNumber() on. */
    virtual double operator()(double k) const = 0;
    virtual double largestWaveNumber() const = 0;
    /**
     * Mean square of what the envelope would be beyond largestWaveNumber(), where it is set to
     * zero, for estimates: 10 %, averaged over its oscillation.
     */
    virtual double squareBeyond(double k) const = 0;
    /** R: the real half of radii ai and aj has faded at R + ai + aj. */
    double range() const { return R; }

protected:
    double R;
};

/**
 * H = H0 - k H0'/2 with H0(k) = psi(kR/c) up to its first zero k0 [T25]. Without the cut at k0 the
 * real half were exactly zero beyond the range.
 */
class ProlateEnvelope : public Envelope {
public:
    /** @param bandwidth  c, in [3, 30]; @param range  R > 0 */
    ProlateEnvelope(double bandwidth, double range);
    std::string name() const override { return "Prolate"; }
    double operator()(double k) const override;
    double largestWaveNumber() const override { return k0; }
    double squareBeyond(double k) const override;
    double bandwidth() const { return psi.bandwidth(); }

private:
    ProlateFunction psi;
    EvenLegendreSeries H; ///< in x = k R/c
    double k0;
};

/**
 * H = (1 + k^2/4xi^2) exp(-k^2/4xi^2), Hasimoto's; its real half decays as exp(-xi^2 (r - ai -
 * aj)^2), and R is where it is cut.
 */
class HasimotoEnvelope : public Envelope {
public:
    HasimotoEnvelope(double xi, double range) : Envelope(range), xi(xi) {}
    std::string name() const override { return "Hasimoto"; }
    double operator()(double k) const override;
    /** H is 5e-18 there. */
    double largestWaveNumber() const override { return 13 * xi; }
    double squareBeyond(double) const override { return 0; }

private:
    double xi;
};

} // namespace PSE::numerics

#endif
