// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_SHEARFLOW_H_
#define OPENMMPSE_NUMERICS_SHEARFLOW_H_

namespace PSE::numerics {

/** The undisturbed flow (rate(t) y, 0, 0) [T35]. */
struct ShearFlow {
    enum class Protocol {
        Steady,      ///< rate at all times
        Oscillatory, ///< rate cos(2 pi t/time): time is the period
        StartUp      ///< none before t = time, rate from then on
    };
    Protocol protocol;
    double rate; ///< 1/ps
    double time; ///< ps

    /**
     * The exact integral of the rate over a step [from, from + dt].
     * @throws std::invalid_argument for a time that is not finite, or a strain that no box can
     * follow
     */
    double strain(double from, double dt) const;
    /** The rate at a time (1/ps). @throws std::invalid_argument for a time that is not finite */
    double rateAt(double t) const;
};

} // namespace PSE::numerics

#endif
