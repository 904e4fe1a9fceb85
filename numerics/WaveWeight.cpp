// SPDX-License-Identifier: MIT
#include "numerics/WaveWeight.h"
#include "numerics/Chebyshev.h"
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace PSE::numerics {

namespace {

constexpr int LOWEST_DEGREE = 4;
/// of one piece; of several, whose coefficients are looked up
constexpr int HIGHEST_DEGREE_ALONE = 32, HIGHEST_DEGREE = 8;
constexpr int MOST_PIECES = 4096;
/// of Horner's rule, in roundings of the smallest weight of a piece
constexpr double ROUNDINGS = 8;

struct Weight {
    const std::function<double(double)>& share;
    const std::function<double(double)>& gain;
    double end2;
};

double absoluteSum(const std::vector<double>& numbers) {
    double sum = 0;
    for (double number : numbers)
        sum += std::fabs(number);
    return sum;
}

/** @return whether the errors are kept */
bool fitPieces(const Weight& weight, const WeightErrors& errors, WaveWeight& fit) {
    const int highest = (fit.pieces == 1 ? HIGHEST_DEGREE_ALONE : HIGHEST_DEGREE);
    std::vector<Polynomial> polynomials;
    fit.degree = LOWEST_DEGREE;
    for (int piece = 0; piece < fit.pieces; piece++) {
        const double width = weight.end2 / fit.pieces,
                     allowed = 0.5 * errors.allowed * weight.gain(std::sqrt(piece * width));
        double smallest = HUGE_VAL;
        const auto w = [&](double t) {
            const double k = std::sqrt(width * (piece + 0.5 * (1 + t))),
                         value = weight.share(k) * weight.gain(k);
            smallest = std::min(smallest, value);
            return value;
        };
        // two degrees more than may be used: the last coefficients tell what is missing
        const Polynomial p = fitPolynomial(w, allowed, LOWEST_DEGREE, highest + 2);
        if (p.degree() > highest || errors.rounding * absoluteSum(p.powers) >
                                        std::max(allowed, ROUNDINGS * errors.rounding * smallest))
            return false;
        fit.degree = std::max(fit.degree, p.degree());
        polynomials.push_back(p);
    }
    fit.powers.assign(size_t(fit.degree + 1) * fit.pieces, 0.0);
    for (int piece = 0; piece < fit.pieces; piece++) {
        const std::vector<double>& powers = polynomials[piece].powers;
        for (size_t power = 0; power < powers.size(); power++)
            fit.powers[(fit.degree - power) * fit.pieces + piece] = powers[power];
    }
    return true;
}

} // namespace

double WaveWeight::operator()(double k2) const {
    if (k2 >= end2)
        return 0;
    const double place = k2 / end2 * pieces;
    const int piece = std::min(static_cast<int>(place), pieces - 1);
    const double t = 2 * (place - piece) - 1;
    double w = 0;
    for (int row = 0; row <= degree; row++)
        w = w * t + powers[size_t(row) * pieces + piece];
    return std::max(0.0, w);
}

WaveWeight fitWaveWeight(const std::function<double(double)>& share,
                         const std::function<double(double)>& gain, double end,
                         const WeightErrors& errors) {
    double low = 0, high = end;
    for (int i = 0; i < 60 && share(high) < 0.5 * errors.allowed; i++) {
        const double middle = 0.5 * (low + high);
        (share(middle) < 0.5 * errors.allowed ? high : low) = middle;
    }
    const Weight weight = {share, gain, high * high};
    WaveWeight fit = {weight.end2, 1, 0, {}};
    for (; fit.pieces <= MOST_PIECES; fit.pieces *= 2)
        if (fitPieces(weight, errors, fit))
            return fit;
    std::ostringstream message;
    message << "the wave factors of a box that moves need more than " << MOST_PIECES
            << " pieces of polynomials for an error of " << errors.allowed
            << "; use the prolate split, or a looser error tolerance";
    throw std::invalid_argument(message.str());
}

} // namespace PSE::numerics
