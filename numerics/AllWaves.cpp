// SPDX-License-Identifier: MIT
#include "numerics/AllWaves.h"
#include <algorithm>

namespace PSE::numerics {

Split::DroppedWaves AllWaves::droppedWaves(const std::array<double, 3>& faces) const {
    return *std::min_element(faces.begin(), faces.end()) < END ? integrateOutside(faces, END)
                                                               : DroppedWaves{0, 0};
}

} // namespace PSE::numerics
