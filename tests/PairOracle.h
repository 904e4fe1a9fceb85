// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_TESTS_PAIRORACLE_H_
#define OPENMMPSE_TESTS_PAIRORACLE_H_

// Pair scalars as integrals over wave numbers in extended precision, by a rule and Bessel functions
// of their own; periodic pair tensors by plain lattice sums. Lengths in radii.

#include "numerics/Lattice.h"
#include "numerics/Split.h"
#include <cmath>

namespace PSE::numerics {

/** j0(x) - j1(x)/x and j2(x)/x^2 in extended precision: Taylor series below 3, closed forms above.
 */
inline void besselReference(long double x, long double& transverse, long double& j2x2) {
    const long double x2 = x * x;
    if (x < 3) {
        // j_l(x)/x^l = sum_n (-x^2/2)^n/(n! (2l + 2n + 1)!!)
        long double j[3] = {0, 0, 0};
        for (int l = 0; l < 3; l++) {
            long double term = (l == 0 ? 1.0L : (l == 1 ? 1.0L / 3 : 1.0L / 15));
            for (int n = 0; n < 40; n++) {
                j[l] += term;
                term *= -x2 / 2 / ((n + 1) * (2 * l + 2 * n + 3));
            }
        }
        transverse = j[0] - j[1];
        j2x2 = j[2];
        return;
    }
    const long double j0 = std::sin(x) / x, j1x = (j0 - std::cos(x)) / x2;
    transverse = j0 - j1x;
    j2x2 = (3 * j1x - j0) / x2;
}

/**
 * The scalars (3/pi) Int w(k) [..] dk of an even, entire weight by the trapezium rule, which then
 * converges faster than any power of the step.
 * @param weight  long double -> long double
 * @param reach   beyond this distance plus r the transform of the weight is negligible
 * @param last    so is the weight beyond this wave number
 */
template <class Weight>
SmoothScalars scalarsByTrapezium(const Weight& weight, long double reach, long double last,
                                 long double r) {
    const long double pi = std::acos(-1.0L), step = 2 * pi / (r + reach);
    long double F = 0, C = 0;
    for (int i = 0; i * step < last; i++) {
        const long double k = i * step, w = (i == 0 ? 0.5L : 1) * weight(k);
        long double transverse, j2x2;
        besselReference(k * r, transverse, j2x2);
        F += w * transverse;
        C += w * k * k * j2x2;
    }
    return {double(3 / pi * step * F), double(3 / pi * step * C)};
}

/** Of a pair at d. */
inline Matrix3 tensor(const PairScalars& s, const Vec3& d) {
    const double r2 = d.squaredNorm();
    return s.F * Matrix3::Identity() +
           (r2 > 0 ? Matrix3((s.G - s.F) / r2 * d * d.transpose()) : Matrix3::Zero());
}

/** The periodic pair tensor by its two lattice sums: pairs within `range`, waves within `kMax`. */
inline Matrix3 periodicTensor(const Split& split, double range, double kMax, const Lattice& box,
                              const Vec3& d) {
    Matrix3 sum = Matrix3::Zero();
    for (const Vec3& image : box.imagesWithin(range))
        if ((d + image).norm() <= range)
            sum += tensor(split.realScalars((d + image).norm()), d + image);
    int limit[3];
    for (int i = 0; i < 3; i++)
        limit[i] = static_cast<int>(kMax * box.length(i) / (2 * M_PI)) + 1;
    for (int i = -limit[0]; i <= limit[0]; i++)
        for (int j = -limit[1]; j <= limit[1]; j++)
            for (int l = -limit[2]; l <= limit[2]; l++) {
                const Vec3 k = box.waveVectors() * Vec3(i, j, l);
                const double k2 = k.squaredNorm();
                if (k2 > 0 && k2 < kMax * kMax)
                    sum += 6 * M_PI / box.volume() * split.waveWeight(std::sqrt(k2)) / k2 *
                           std::cos(k.dot(d)) * (Matrix3::Identity() - k * k.transpose() / k2);
            }
    return sum;
}

} // namespace PSE::numerics

#endif
