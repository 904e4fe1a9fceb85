// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_LANCZOS_H_
#define OPENMMPSE_NUMERICS_LANCZOS_H_

// M^{1/2} z for a symmetric positive semi-definite M known only by its products [T18]. Written once
// over a few vector operations that each platform supplies.

#include "numerics/Vec3.h"
#include <cmath>
#include <vector>

namespace PSE::numerics {

/**
 * The small tridiagonal side of the Lanczos process: coefficients of M^{1/2} z in the Krylov basis.
 */
class LanczosTridiagonal {
public:
    static constexpr int MAX_ITERATIONS = 100;

    /**
     * @param tolerance          relative error of M^{1/2} z (2-norm) at which to stop
     * @param negativeTolerance  eigenvalues above -negativeTolerance times the largest count as
     * zero: rounding, and the truncation of M itself
     */
    LanczosTridiagonal(double tolerance, double negativeTolerance)
        : tolerance(tolerance), negativeTolerance(negativeTolerance) {}

    /**
     * Add a row. The changes of M^{1/2} z from one iteration to the next fall about geometrically;
     * it is accepted once the sum of those still to come is below the tolerance, relative to
     * |M^{1/2} z|, whose exact value |z| sqrt(alpha_1) is known after the first iteration. The true
     * error is below 2 tolerances for condition numbers up to 50, below 6 up to 1e8.
     * @param alpha  diagonal entry of this iteration
     * @param beta   norm of the next basis vector before normalisation (0: the Krylov space is
     * exhausted)
     * @return whether the process is finished
     * @throws std::runtime_error for an indefinite M, or without convergence in MAX_ITERATIONS
     */
    bool add(double alpha, double beta);
    int iterations() const { return static_cast<int>(diagonal.size()); }
    /** T^{1/2} e_1: coefficients of M^{1/2} z/|z| in the basis, one per iteration. */
    const Eigen::VectorXd& coefficients() const { return solution; }

private:
    /**
     * Estimate of the changes still to come, from the larger of the last two ratios of successive
     * changes.
     */
    double remaining(double change) const;

    double tolerance, negativeTolerance, lastChange = 1, lastRatio = 0;
    std::vector<double> diagonal, offDiagonal;
    Eigen::VectorXd solution;
};

/**
 * Compute result = M^{1/2} z. Space supplies:
 *
 *     using Vector = ...;                             a vector of the platform, contents kept where
 * they are Vector& basis(int i);                           storage for basis vector i void
 * multiply(const Vector& v, Vector& Mv); double dot(const Vector& v, const Vector& w); accumulated
 * in double void scaledCopy(double s, const Vector& v, Vector& out);        out = s v void
 * addScaled(double s, const Vector& v, Vector& out);         out += s v
 *
 * @param reorthogonalise  against all earlier basis vectors: needed for errors near rounding
 * @return number of iterations
 */
template <class Space>
int lanczosSquareRoot(Space& space, const typename Space::Vector& z, typename Space::Vector& result,
                      double tolerance, double negativeTolerance, bool reorthogonalise) {
    const double norm = std::sqrt(space.dot(z, z));
    if (norm == 0) {
        space.scaledCopy(0, z, result);
        return 0;
    }
    LanczosTridiagonal small(tolerance, negativeTolerance);
    space.scaledCopy(1 / norm, z, space.basis(0));
    double beta = 0;
    for (int i = 0;; i++) {
        typename Space::Vector& next = space.basis(i + 1);
        space.multiply(space.basis(i), next);
        if (i > 0)
            space.addScaled(-beta, space.basis(i - 1), next);
        const double alpha = space.dot(space.basis(i), next);
        space.addScaled(-alpha, space.basis(i), next);
        if (reorthogonalise)
            for (int j = i; j >= 0; j--)
                space.addScaled(-space.dot(space.basis(j), next), space.basis(j), next);
        beta = std::sqrt(space.dot(next, next));
        if (small.add(alpha, beta))
            break;
        space.scaledCopy(1 / beta, next, next);
    }
    space.scaledCopy(norm * small.coefficients()[0], space.basis(0), result);
    for (int i = 1; i < small.iterations(); i++)
        space.addScaled(norm * small.coefficients()[i], space.basis(i), result);
    return small.iterations();
}

} // namespace PSE::numerics

#endif
