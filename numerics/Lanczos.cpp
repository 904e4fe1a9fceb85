// SPDX-License-Identifier: MIT
#include "numerics/Lanczos.h"
#include "numerics/TridiagonalRoot.h"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

namespace PSE::numerics {

namespace {
/// Of the tolerance: what T^{1/2} e_1 may err by where it need not be exact, and what it cannot be.
constexpr double ROOT_SHARE = 0.01, FINEST_ROOT = 1e-14;
} // namespace

bool LanczosTridiagonal::add(double alpha, double beta) {
    if (!std::isfinite(alpha) || !std::isfinite(beta))
        throw std::runtime_error(std::string("the ") + kind.mobility +
                                 "mobility produced a non-finite number in the Lanczos iteration; "
                                 "check positions and parameters");
    diagonal.push_back(alpha);
    const int n = iterations();
    double highest;
    const Eigen::VectorXd next = root(highest);
    double square = next.squaredNorm();
    if (n > 1)
        square = (next.head(n - 1) - solution).squaredNorm() + next[n - 1] * next[n - 1];
    solution = next;
    const double change = std::sqrt(square / diagonal[0]);
    const bool exhausted = beta <= 1e-14 * highest;
    if (exhausted || (n > 1 && remaining(change) <= tolerance))
        return true;
    if (n == kind.mostIterations) {
        double lowest;
        rootByEigenvalues(lowest, highest);
        std::ostringstream message;
        message << "the " << kind.mobility << "noise did not converge in " << n
                << " Lanczos iterations: estimated relative error " << remaining(change)
                << ", wanted " << tolerance << ", smallest eigenvalue " << lowest
                << " of a largest of " << highest << "; " << kind.remedy;
        throw std::runtime_error(message.str());
    }
    offDiagonal.push_back(beta);
    lastRatio = (n > 1 ? change / lastChange : 0);
    lastChange = change;
    return false;
}

/** T^{1/2} e_1, and the largest eigenvalue or, where that is enough, a bound. */
Eigen::VectorXd LanczosTridiagonal::root(double& highest) const {
    Eigen::VectorXd x;
    if (kind.many && diagonal[0] > 0 &&
        tridiagonalRoot(diagonal, offDiagonal, std::max(ROOT_SHARE * tolerance, FINEST_ROOT), x)) {
        highest = largestEigenvalueBound(diagonal, offDiagonal);
        return x;
    }
    double lowest;
    x = rootByEigenvalues(lowest, highest);
    if (lowest < -negativeTolerance * highest || highest < 0) {
        std::ostringstream message;
        message << "the " << kind.mobility << "mobility is not positive: Lanczos iteration "
                << iterations() << " found the eigenvalue " << lowest << " beside a largest of "
                << highest << " (allowed: " << -negativeTolerance * highest
                << "); tighten the tolerance";
        throw std::runtime_error(message.str());
    }
    return x;
}

Eigen::VectorXd LanczosTridiagonal::rootByEigenvalues(double& lowest, double& highest) const {
    const int n = iterations();
    const Eigen::Map<const Eigen::VectorXd> d(diagonal.data(), n), e(offDiagonal.data(), n - 1);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen;
    eigen.computeFromTridiagonal(d, e);
    lowest = eigen.eigenvalues()[0];
    highest = eigen.eigenvalues()[n - 1];
    const Eigen::VectorXd roots = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
    return eigen.eigenvectors() * roots.cwiseProduct(eigen.eigenvectors().row(0).transpose());
}

double LanczosTridiagonal::remaining(double change) const {
    const double ratio = std::min(0.99, std::max(lastRatio, change / lastChange));
    return change * ratio / (1 - ratio);
}

} // namespace PSE::numerics
