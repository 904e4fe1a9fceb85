// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_PARTICLEORDER_H_
#define OPENMMPSE_PARTICLEORDER_H_

#include <vector>

namespace PSE {

/**
 * Stable counting sort. Afterwards order[start[key]] to order[start[key + 1] - 1] are the particles
 * with that key, in ascending order: the result depends on the keys alone.
 * @param keys  one per particle, in [0, numKeys)
 */
inline void sortByKey(const std::vector<int>& keys, int numKeys, std::vector<int>& start,
                      std::vector<int>& order) {
    start.assign(numKeys + 1, 0);
    order.resize(keys.size());
    for (int key : keys)
        start[key + 1]++;
    for (int key = 0; key < numKeys; key++)
        start[key + 1] += start[key];
    for (size_t i = 0; i < keys.size(); i++)
        order[start[keys[i]]++] = static_cast<int>(i);
    for (int key = numKeys; key > 0; key--) // each start has moved to its end
        start[key] = start[key - 1];
    start[0] = 0;
}

} // namespace PSE

#endif
