// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICECLOCK_H_
#define OPENMMPSE_DEVICECLOCK_H_

#include "DeviceArrays.h"
#include "StageClock.h"

namespace PSE {

/**
 * Charges stages of a step that runs on a device, by waiting for it after each of them. Waiting
 * costs time of its own: a few steps are measured, and stand for all.
 */
class DeviceClock {
public:
    DeviceClock(OpenMM::ComputeContext& context, StageClock& clock) : clock(clock) {
        token.initialize<int>(context, 1, "pseToken");
    }
    /** Begin a step, or something else that is not to be charged (measured = false). */
    void start(bool measured) {
        running = measured;
        if (running) {
            wait();
            clock.start();
        }
    }
    void charge(const char* stage) {
        if (running) {
            wait();
            clock.charge(stage);
        }
    }

private:
    void wait() {
        int value;
        token.download(&value);
    }
    StageClock& clock;
    OpenMM::ComputeArray token;
    bool running = false;
};

} // namespace PSE

#endif
