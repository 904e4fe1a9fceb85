// SPDX-License-Identifier: MIT
#include "numerics/TridiagonalRoot.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

double largestEigenvalueBound(const std::vector<double>& diagonal,
                              const std::vector<double>& offDiagonal) {
    double bound = 0;
    for (size_t i = 0; i < diagonal.size(); i++) {
        const double before = i > 0 ? std::fabs(offDiagonal[i - 1]) : 0,
                     after = i + 1 < diagonal.size() ? std::fabs(offDiagonal[i]) : 0;
        bound = std::max(bound, diagonal[i] + before + after);
    }
    return bound;
}

bool tridiagonalRoot(const std::vector<double>& diagonal, const std::vector<double>& offDiagonal,
                     double error, Eigen::VectorXd& x) {
    const int n = static_cast<int>(diagonal.size());
    // The sum errs by 2 exp(-pi^2/h), cutting it at t by (t^2/lambda)^{3/2} below and by its
    // inverse above, once the leading term of what is cut off has been added.
    const double h = M_PI * M_PI / std::log(2 / error), step = std::exp(h),
                 first = error * std::sqrt(diagonal[0]),
                 last = std::sqrt(largestEigenvalueBound(diagonal, offDiagonal)) / std::cbrt(error);
    const int nodes = 2 + static_cast<int>(std::log(last / first) / h);
    Eigen::ArrayXd t(nodes);
    t[0] = first;
    for (int j = 1; j < nodes; j++)
        t[j] = t[j - 1] * step;

    // All (T + t^2) y = e_1 at once: pivots from the last row up, then y down.
    Eigen::ArrayXXd pivots(nodes, n);
    const Eigen::ArrayXd shifts = t.square();
    pivots.col(n - 1) = diagonal[n - 1] + shifts;
    for (int i = n - 2; i >= 0; i--)
        pivots.col(i) = diagonal[i] + shifts - offDiagonal[i] * offDiagonal[i] / pivots.col(i + 1);
    if (!(pivots > 0).all())
        return false;
    const double rest = 1 / (step - 1); // a geometric series beyond its first term
    Eigen::VectorXd sum(n);             // of t y
    Eigen::ArrayXd y = t / pivots.col(0);
    sum[0] = y.sum() + rest / t[nodes - 1];
    for (int i = 1; i < n; i++) {
        y *= -offDiagonal[i - 1] / pivots.col(i);
        sum[i] = y.sum();
    }
    x.resize(n);
    for (int i = 0; i < n; i++)
        x[i] = diagonal[i] * sum[i] + (i > 0 ? offDiagonal[i - 1] * sum[i - 1] : 0) +
               (i + 1 < n ? offDiagonal[i] * sum[i + 1] : 0);
    x[0] += first * rest;
    x *= 2 * h / M_PI;
    return true;
}

} // namespace PSE::numerics
