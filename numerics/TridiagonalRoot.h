// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_TRIDIAGONALROOT_H_
#define OPENMMPSE_NUMERICS_TRIDIAGONALROOT_H_

#include "numerics/Vec3.h"
#include <vector>

namespace PSE::numerics {

/**
 * x = T^{1/2} e_1 for a symmetric tridiagonal T, at a cost linear in its size: by the integral of
 * T (t^2 + T)^{-1} over t, the trapezium rule in ln t [T33]. An eigenvalue decomposition costs the
 * cube of the size.
 *
 * @param diagonal     n entries, the first > 0
 * @param offDiagonal  n - 1 entries
 * @param error        of x, relative to |x| = sqrt(T_11); >= 1e-14
 * @param x            the result, n entries
 * @return false, and no result, if T has an eigenvalue below 0 by more than rounding of error^2
 * T_11
 */
bool tridiagonalRoot(const std::vector<double>& diagonal, const std::vector<double>& offDiagonal,
                     double error, Eigen::VectorXd& x);

/** A bound of the largest eigenvalue: Gershgorin's discs. */
double largestEigenvalueBound(const std::vector<double>& diagonal,
                              const std::vector<double>& offDiagonal);

} // namespace PSE::numerics

#endif
