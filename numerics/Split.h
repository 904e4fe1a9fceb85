// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_SPLIT_H_
#define OPENMMPSE_NUMERICS_SPLIT_H_

// The positive split of the mobility, M = M_W + M_R [T4, T5]:
//
//     M_W(k) = 1/(eta V k^2) w(k) (I - kk),    0 <= w(k) <= t(k)
//
// A split is its wave weight w; t is that of the whole mobility, sinc^2(k a) for
// Rotne-Prager-Yamakawa [T2] and exp(-k^2 a^2/pi) for force coupling [T41]. What is left for real
// space is M_R = M - (integral of M_W over all k), for every distance, overlaps included.
//
// Everything here is in reduced units: lengths in radii a, wave numbers in 1/a, mobilities in 1/(6
// pi eta a).

#include "numerics/Rpy.h"
#include "numerics/SphereModel.h"
#include <array>
#include <cmath>
#include <functional>
#include <string>

namespace PSE::numerics {

/** Distance of two touching spheres. */
constexpr double CONTACT = 2;

class Split {
public:
    explicit Split(SphereModel model = SphereModel::RotnePragerYamakawa) : sphereModel(model) {}
    virtual ~Split() = default;
    virtual std::string name() const = 0;
    /** What is divided. */
    SphereModel model() const { return sphereModel; }
    /** Wave weight w(k) for k >= 0. */
    virtual double waveWeight(double k) const = 0;
    /**
     * Wave part of the pair tensor in infinite fluid, (3/pi) Int w(k) [..] dk [T6], for 0 <= r <=
     * maxDistance().
     */
    virtual SmoothScalars waveScalars(double r) const = 0;
    /** Largest distance at which waveScalars() may be asked; the real part has vanished there. */
    virtual double maxDistance() const = 0;
    /**
     * Largest range whose polynomials (RealTable) keep their digits by Horner's rule: 5e-7 in
     * single, 1e-12 in double precision.
     */
    virtual double tableRange(bool single) const = 0;

    /** Real part of the pair tensor, total minus wave part [T7], for 0 <= r <= maxDistance(). */
    PairScalars realScalars(double r) const;
    /** Real part of the self mobility, 1 - F_W(0) [T7]. */
    double realSelf() const { return 1 - waveScalars(0).F; }

    /**
     * Root mean square error of M f, for unit random forces at volume fraction phi, caused by
     * dropping all wave numbers above kMax [T12], beside those that the split itself drops [T22].
     */
    double waveTruncation(double kMax, double phi) const;
    /** Parts that add in squares: of pairs, and of the self mobility. */
    struct Truncation {
        double pairs, self;
        double total() const { return std::sqrt(pairs * pairs + self * self); }
    };
    /**
     * The same for all wave vectors outside the Nyquist cell of a grid, or more [T14].
     * @param faces  distances of the three pairs of faces of that cell from k = 0
     */
    Truncation bandTruncation(const std::array<double, 3>& faces, double phi) const;
    /**
     * Smallest wave number above which waveTruncation() is at most error; the end of w if none is.
     */
    double waveCutoff(double error, double phi) const;
    /**
     * Error of M f, for unit forces, caused by dropping all pairs beyond rc [T13]: the root mean
     * square for random forces, and what adds up if all forces are alike.
     * @param phi      volume fraction around a particle
     * @param meanPhi  that of the whole box: like forces in a dense cluster add up in M f itself,
     * too
     */
    virtual double realTruncation(double rc, double phi, double meanPhi) const = 0;
    double realTruncation(double rc, double phi) const { return realTruncation(rc, phi, phi); }
    /**
     * Smallest distance (>= 2, beyond overlap) above which realTruncation() is at most error.
     */
    double realCutoff(double error, double phi, double meanPhi) const;
    double realCutoff(double error, double phi) const { return realCutoff(error, phi, phi); }
    /** Beyond, w is zero or below 1e-17. */
    virtual double largestWaveNumber() const = 0;

protected:
    /** Int W^2/k^2 dk and Int W dk over wave numbers that are left out. */
    struct DroppedWaves {
        double pairs, self;
    };
    /** The same over [kMax, infinity), 0 < kMax. */
    virtual DroppedWaves droppedWaves(double kMax) const = 0;
    /** The same outside a cell; unless a split knows better, outside the sphere inside it. */
    virtual DroppedWaves droppedWaves(const std::array<double, 3>& faces) const;
    /**
     * Over [from, to], w alone: 64 Gauss-Legendre nodes.
     * @param share  of the directions, by k
     */
    DroppedWaves integrateWaves(
        double from, double to,
        const std::function<double(double)>& share = [](double) { return 1.0; }) const;
    /** Of all that lies outside a cell, up to a wave number beyond its nearest face. */
    DroppedWaves integrateOutside(const std::array<double, 3>& faces, double to) const;

private:
    Truncation truncationOf(const DroppedWaves& dropped, double phi) const;

    SphereModel sphereModel;
};

} // namespace PSE::numerics

#endif
