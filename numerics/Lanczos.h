// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_LANCZOS_H_
#define OPENMMPSE_NUMERICS_LANCZOS_H_

// M^{1/2} z for a symmetric positive semi-definite M known only by its products [T18]. Written once
// over a few vector operations that each platform supplies.

#include "numerics/Vec3.h"
#include <cmath>
#include <vector>

namespace PSE::numerics {

/** How the small side works, and the words of its refusals. */
struct LanczosKind {
    int mostIterations;
    /// iterations: T^{1/2} e_1 by a method whose cost is linear in their number, and vectors made
    /// orthogonal to all earlier ones in every precision
    bool many;
    const char *mobility, *remedy;
};

/**
 * The small tridiagonal side of the Lanczos process: coefficients of M^{1/2} z in the Krylov basis.
 */
class LanczosTridiagonal {
public:
    static constexpr int MAX_ITERATIONS = 100;
    /// a real-space half is well conditioned: few iterations
    static constexpr LanczosKind REAL_HALF = {
        MAX_ITERATIONS, false, "real-space ",
        "loosen the tolerance or set a larger splitting parameter"};
    /// The same to rounding, whatever was asked for.
    static constexpr LanczosKind EXACT_REAL_HALF = {1000, false, "real-space ",
                                                    "set a larger splitting parameter"};
    /// The mobility of chains and globules in an unbounded fluid is not.
    static constexpr LanczosKind WHOLE = {1000, true, "", "loosen the tolerance"};

    /**
     * @param tolerance          relative error of M^{1/2} z (2-norm) at which to stop
     * @param negativeTolerance  eigenvalues above -negativeTolerance times the largest count as
     * zero: rounding, and the truncation of M itself
     */
    LanczosTridiagonal(double tolerance, double negativeTolerance,
                       const LanczosKind& kind = REAL_HALF)
        : tolerance(tolerance), negativeTolerance(negativeTolerance), kind(kind) {}

    /**
     * Add a row. The changes of M^{1/2} z from one iteration to the next fall about geometrically;
     * it is accepted once the sum of those still to come is below the tolerance, relative to
     * |M^{1/2} z|, whose exact value |z| sqrt(alpha_1) is known after the first iteration. The true
     * error is below 2 tolerances for condition numbers up to 50, below 6 up to 1e8. Where there
     * may be many iterations, a change that falls out of line ends nothing for three of them:
     * eigenvalues in groups (unequal spheres at one place) are found group by group, and errors
     * of 10 tolerances are seen.
     * @param alpha  diagonal entry of this iteration
     * @param beta   norm of the next basis vector before normalisation (0: the Krylov space is
     * exhausted)
     * @return whether the process is finished
     * @throws std::runtime_error for an indefinite M, or without convergence in as many iterations
     * as there may be
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
    [[noreturn]] void refuseUnfinished(double left) const;
    Eigen::VectorXd root(double& highest) const;
    Eigen::VectorXd rootByEigenvalues(double& lowest, double& highest) const;

    double tolerance, negativeTolerance;
    LanczosKind kind;
    double lastChange = 1, lastRatio = 0, earlierRatio = 0;
    int distrusted = 0; ///< iterations from here on that do not finish the process
    int doubts = 0;     ///< how often they might have
    std::vector<double> diagonal, offDiagonal;
    double leastLeft = 1; ///< least estimate of changes still to come
    Eigen::VectorXd solution;
};

/**
 * Take out of a vector what it has of all basis vectors, classical Gram-Schmidt: one pass over the
 * basis finds all overlaps, another removes them. Where that takes more than half of its square,
 * what is left has overlaps of its own by rounding, and both are done once more; twice is enough
 * (Daniel, Gragg, Kaufman and Stewart 1976). Where a three-term recurrence has just removed all
 * that it can, once nearly always is.
 * @param norms   of the basis vectors
 * @param square  that of the vector
 * @return the square of what is left
 */
template <class Space>
double orthogonalise(Space& space, const std::vector<double>& norms, typename Space::Vector& vector,
                     double square) {
    for (int pass = 0; pass < 2; pass++) {
        const double before = square;
        std::vector<double> overlaps = space.dots(static_cast<int>(norms.size()), vector);
        for (size_t i = 0; i < norms.size(); i++)
            overlaps[i] /= -norms[i] * norms[i];
        square = space.addCombination(overlaps, vector);
        if (square > 0.5 * before)
            break;
    }
    return square;
}

/**
 * Compute result = M^{1/2} z. Basis vector i is basis(i) over its norm; Space supplies
 *
 *     using Vector = ...;      a vector of the platform, contents kept where they are
 *     Vector& basis(int i);    storage; basis(0) holds z
 *     double multiplyAdd(const Vector& v, double s, const Vector& w, double t, Vector& out);
 *                              out = s M v + t w; returns v . out
 *     double addScaled(double s, const Vector& v, Vector& out);   out += s v; returns out . out
 *     std::vector<double> dots(int count, const Vector& v);
 *                              v . basis(i) for i < count
 *     double addCombination(const std::vector<double>& c, Vector& out);
 *                              out += sum of c_i basis(i); returns out . out
 *     void clear(Vector& out); out = 0, of the size of a basis vector
 *
 * with sums accumulated in double.
 *
 * @param small            its tridiagonal side, new
 * @param reorthogonalise  against all earlier basis vectors: needed for errors near rounding, and
 * where there are many iterations
 * @return number of iterations
 */
template <class Space>
int lanczosSquareRoot(Space& space, typename Space::Vector& result, LanczosTridiagonal small,
                      bool reorthogonalise) {
    space.clear(result);
    std::vector<double> norms = {std::sqrt(space.dots(1, space.basis(0))[0])};
    if (norms[0] == 0)
        return 0;
    for (int i = 0;; i++) {
        typename Space::Vector &current = space.basis(i), &next = space.basis(i + 1);
        // The norm of the next vector is the off-diagonal entry beta: next = M v_i - beta v_{i-1}.
        const double overlap =
            space.multiplyAdd(current, 1 / norms[i], space.basis(i > 0 ? i - 1 : 0),
                              i > 0 ? -norms[i] / norms[i - 1] : 0, next);
        const double alpha = overlap / norms[i];
        double square = space.addScaled(-alpha / norms[i], current, next);
        if (reorthogonalise)
            square = orthogonalise(space, norms, next, square);
        const double beta = std::sqrt(square);
        if (small.add(alpha, beta))
            break;
        norms.push_back(beta);
    }
    std::vector<double> coefficients;
    for (int i = 0; i < small.iterations(); i++)
        coefficients.push_back(norms[0] * small.coefficients()[i] / norms[i]);
    space.addCombination(coefficients, result);
    return small.iterations();
}
template <class Space>
int lanczosSquareRoot(Space& space, typename Space::Vector& result, double tolerance,
                      double negativeTolerance, bool reorthogonalise) {
    return lanczosSquareRoot(space, result, LanczosTridiagonal(tolerance, negativeTolerance),
                             reorthogonalise);
}

} // namespace PSE::numerics

#endif
