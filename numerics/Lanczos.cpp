// SPDX-License-Identifier: MIT
#include "numerics/Lanczos.h"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace PSE::numerics {

bool LanczosTridiagonal::add(double alpha, double beta) {
    if (!std::isfinite(alpha) || !std::isfinite(beta))
        throw std::runtime_error(
            "the real-space mobility produced a non-finite number in the Lanczos iteration; "
            "check positions and parameters");
    diagonal.push_back(alpha);
    const int n = iterations();
    const Eigen::Map<const Eigen::VectorXd> d(diagonal.data(), n), e(offDiagonal.data(), n - 1);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen;
    eigen.computeFromTridiagonal(d, e);
    const double lowest = eigen.eigenvalues()[0], highest = eigen.eigenvalues()[n - 1];
    if (lowest < -negativeTolerance * highest || highest < 0) {
        std::ostringstream message;
        message << "the real-space mobility is not positive: Lanczos iteration " << n
                << " found the eigenvalue " << lowest << " beside a largest of " << highest
                << " (allowed: " << -negativeTolerance * highest << "); tighten the tolerance";
        throw std::runtime_error(message.str());
    }
    const Eigen::VectorXd roots = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
    const Eigen::VectorXd next =
        eigen.eigenvectors() * roots.cwiseProduct(eigen.eigenvectors().row(0).transpose());
    double square = next.squaredNorm();
    if (n > 1)
        square = (next.head(n - 1) - solution).squaredNorm() + next[n - 1] * next[n - 1];
    solution = next;
    const double change = std::sqrt(square / diagonal[0]);
    const bool exhausted = beta <= 1e-14 * highest;
    if (exhausted || (n > 1 && remaining(change) <= tolerance))
        return true;
    if (n == MAX_ITERATIONS) {
        std::ostringstream message;
        message << "the real-space noise did not converge in " << n
                << " Lanczos iterations: estimated relative error " << remaining(change)
                << ", wanted " << tolerance << ", smallest eigenvalue " << lowest
                << " of a largest of " << highest
                << "; loosen the tolerance or set a larger splitting parameter";
        throw std::runtime_error(message.str());
    }
    offDiagonal.push_back(beta);
    lastRatio = (n > 1 ? change / lastChange : 0);
    lastChange = change;
    return false;
}

double LanczosTridiagonal::remaining(double change) const {
    const double ratio = std::min(0.99, std::max(lastRatio, change / lastChange));
    return change * ratio / (1 - ratio);
}

} // namespace PSE::numerics
