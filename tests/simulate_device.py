# SPDX-License-Identifier: MIT
"""Every device kernel on a simulator of a device, in every precision: to be run as

    oclgrind --data-races --log FILE python tests/simulate_device.py

Whatever stands in FILE then is a defect: two threads that use one place of memory in an order that
nothing ensures, or an access outside of an array. Oclgrind optimises the kernels first, so that it
sees no race which a compiler may or may not make (test_devices.py looks for those in the text).
"""

import sys

import devicescenes
from nvrtc import PRECISIONS

SIMULATOR = "Oclgrind"


def main():
    for precision in PRECISIONS:
        for number, scene in enumerate(devicescenes.allFor(precision)):
            context = devicescenes.runOnOpenCL(precision, *scene)
            device = context.getPlatform().getPropertyValue(context, "DeviceName")
            if SIMULATOR not in device:
                return f"scenes run on {device}, not on {SIMULATOR}: start this with the program oclgrind"
            print(f"OpenCL-{precision}, scene {number + 1}: done", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
