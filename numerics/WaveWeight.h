// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_WAVEWEIGHT_H_
#define OPENMMPSE_NUMERICS_WAVEWEIGHT_H_

#include <functional>
#include <vector>

namespace PSE::numerics {

/**
 * A weight of waves, w(k) >= 0, as polynomials in k^2 on intervals of equal width: for boxes that
 * move, whose factors are made anew in every step [T36].
 */
struct WaveWeight {
    double end2; ///< k^2 from which on the weight counts as 0, in 1/a^2
    int pieces;
    int degree;
    /// [degree + 1][pieces], highest power first, in t = 2 (k^2 pieces/end2 - piece) - 1
    std::vector<double> powers;

    /** w(k), never negative. @param k2  k^2 in 1/a^2, >= 0 */
    double operator()(double k2) const;
};

struct WeightErrors {
    double allowed;  ///< absolute, of w/gain
    double rounding; ///< relative, of the numbers that the polynomials are evaluated in
};

/**
 * w = share gain with as few pieces as reach the errors. Rounding may exceed what is allowed where
 * it is that of w itself.
 * @param share  falls from 1 towards `end`; what is below half the error allowed is left out
 * @param gain   at least 1, grows with k: the window, by which errors count less where it is small
 * @param end    in 1/a; the share is negligible beyond
 * @throws std::invalid_argument if no pieces reach the errors
 */
WaveWeight fitWaveWeight(const std::function<double(double)>& share,
                         const std::function<double(double)>& gain, double end,
                         const WeightErrors& errors);

} // namespace PSE::numerics

#endif
