// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_STEPGROWTH_H_
#define OPENMMPSE_NUMERICS_STEPGROWTH_H_

#include <limits>

namespace PSE::numerics {

/**
 * Tells steps that are too long for their forces from steps that are merely long [T63]: whether the
 * largest velocity has grown in each of many steps, and much in all.
 */
class StepGrowth {
public:
    static constexpr double LEAST = 1.05; ///< factor from one step to the next
    static constexpr int STEPS = 10;      ///< in a row, at least
    static constexpr double IN_ALL = 1e3; ///< factor over all of them, at least

    /**
     * A step is made.
     * @param velocity  the largest one, not negative
     * @param size      of the step; units are always the same
     */
    void add(double velocity, double size) {
        if (last > 0 && velocity >= LEAST * last && size == lastSize) // nothing grows from 0
            count++;
        else {
            count = 0;
            first = velocity;
        }
        last = velocity;
        lastSize = size;
    }
    /** Whether such a step is the next of a growth that does not end by itself. */
    bool isRunaway(double velocity, double size) const {
        return count + 1 >= STEPS && velocity >= LEAST * last && velocity >= IN_ALL * first &&
               size == lastSize;
    }
    /** The next step says nothing about those before. */
    void forget() { *this = StepGrowth(); }
    /** Steps in a row that have grown. */
    int length() const { return count; }
    /** The velocity that the growth began with. */
    double start() const { return first; }

private:
    static constexpr double NEVER = std::numeric_limits<double>::infinity();
    double first = NEVER, last = NEVER, lastSize = 0;
    int count = 0;
};

} // namespace PSE::numerics

#endif
