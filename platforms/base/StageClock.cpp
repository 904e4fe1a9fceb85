// SPDX-License-Identifier: MIT
#include "StageClock.h"

namespace PSE {

void StageClock::charge(const char* stage) {
    const Clock::time_point now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - last).count();
    last = now;
    for (StageTime& entry : stages)
        if (entry.stage == stage) {
            entry.seconds += seconds;
            return;
        }
    stages.push_back({stage, seconds});
}

} // namespace PSE
