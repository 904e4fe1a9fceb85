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
/// A ratio of changes below this part of the last two is no sign of convergence; for so many
/// iterations.
constexpr double OUT_OF_LINE = 0.5;
constexpr int DISTRUSTED = 3;
/// So often a result may be doubted: in single precision changes never fall in line.
constexpr int MOST_DOUBTS = 8;
} // namespace

bool LanczosTridiagonal::add(double alpha, double beta) {
    if (!std::isfinite(alpha) || !std::isfinite(beta))
        throw std::runtime_error(std::string("the ") + kind.mobility +
                                 "mobility produced a non-finite number in the Lanczos iteration; "
                                 "check positions and parameters");
    diagonal.push_back(alpha);
    const int n = iterations();
    double highest;
    Eigen::VectorXd next;
    try {
        next = root(highest);
    } catch (const std::runtime_error&) {
        // Rounding of eigenvalues shows by its root in what they add to the solution.
        if (!kind.many || leastLeft > std::sqrt(negativeTolerance))
            throw;
        solution.conservativeResizeLike(Eigen::VectorXd::Zero(n));
        return true;
    }
    double square = next.squaredNorm();
    if (n > 1)
        square = (next.head(n - 1) - solution).squaredNorm() + next[n - 1] * next[n - 1];
    solution = next;
    const double change = std::sqrt(square / diagonal[0]);
    const bool exhausted = beta <= 1e-14 * highest;
    if (kind.many && change < OUT_OF_LINE * std::max(lastRatio, earlierRatio) * lastChange)
        distrusted = DISTRUSTED;
    const bool near = n > 1 && remaining(change) <= tolerance;
    if (exhausted || (near && (distrusted == 0 || doubts == MOST_DOUBTS)))
        return true;
    doubts += near;
    if (n > 1)
        leastLeft = std::min(leastLeft, remaining(change));
    distrusted = std::max(0, distrusted - 1);
    if (n == kind.mostIterations)
        refuseUnfinished(remaining(change));
    offDiagonal.push_back(beta);
    earlierRatio = lastRatio;
    lastRatio = (n > 1 ? change / lastChange : 0);
    lastChange = change;
    return false;
}

void LanczosTridiagonal::refuseUnfinished(double left) const {
    double lowest, highest;
    rootByEigenvalues(lowest, highest);
    std::ostringstream message;
    message << "the " << kind.mobility << "noise did not converge in " << iterations()
            << " Lanczos iterations: estimated relative error " << left << ", wanted " << tolerance
            << ", smallest eigenvalue " << lowest << " of a largest of " << highest << "; "
            << kind.remedy;
    throw std::runtime_error(message.str());
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
