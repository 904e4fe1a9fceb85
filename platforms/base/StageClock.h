// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_STAGECLOCK_H_
#define OPENMMPSE_STAGECLOCK_H_

#include "openmmpse/internal/Scene.h"
#include <chrono>
#include <vector>

namespace PSE {

/// the stage of what a box costs that moves, beside the rest of a step
constexpr char MOVING_BOX[] = "wave factors of the moving box";

/** Stage times, in the order in which the stages first ran. */
class StageClock {
public:
    using Clock = std::chrono::steady_clock;
    /** Charge the time since the last call (or start()) to a stage. */
    void start() { last = Clock::now(); }
    void charge(const char* stage);
    const std::vector<StageTime>& times() const { return stages; }

private:
    Clock::time_point last;
    std::vector<StageTime> stages;
};

} // namespace PSE

#endif
