// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_PLANCOST_H_
#define OPENMMPSE_NUMERICS_PLANCOST_H_

namespace PSE::numerics {

/**
 * Deterministic model of the time of one step (in ns on one thread of a shared 2.5 GHz server core
 * with AVX-512): only the ratios matter, for the choice of xi. Fitted to stage times by
 * benchmarks/calibrate_cost.py; never measured inside a run, so that the same scene gives the same
 * Plan on every machine.
 */
struct CostModel {
    /// per particle and point of its P^3 window: spread and gather, three components
    static constexpr double SPREAD = 2;
    /// the same per point of the ball or shell of a radial window, and per power of its polynomial
    static constexpr double SPREAD_RADIAL = 3.7, SPREAD_POWER = 0.16;
    /// the same per particle whose rows are sums of products [T54], and per row
    static constexpr double SPREAD_SPHERE = 100, SPREAD_ROW = 12;
    /// per grid point: six real transforms, noise, wave factor
    static constexpr double GRID = 75;
    /// per particle and mode of a direct sum, there and back
    static constexpr double DIRECT = 25;
    /// per ordered pair in range: distance and coefficients
    static constexpr double PAIR_BUILD = 30;
    static constexpr double PAIR_APPLY = 5; ///< per ordered pair in range and product with M_R
    /// times both for a pair of a mixture: longer formulas, but fuller vectors
    static constexpr double MIXTURE_PAIR = 1.2;

    /**
     * @param pairs   ordered pairs (images included) in range
     * @param products   products with M_R in a step
     */
    static double step(double particles, double gridPoints, int windowSupport, double pairs,
                       double products) {
        const double support = windowSupport;
        return particles * SPREAD * support * support * support + gridPoints * GRID +
               pairs * (PAIR_BUILD + products * PAIR_APPLY);
    }

    /** The same for direct sums over the modes of the grid, of which half are independent. */
    static double directStep(double particles, double gridPoints, double pairs, double products) {
        return 0.5 * gridPoints * particles * DIRECT + pairs * (PAIR_BUILD + products * PAIR_APPLY);
    }
};

} // namespace PSE::numerics

#endif
