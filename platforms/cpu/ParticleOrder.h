// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_PARTICLEORDER_H_
#define OPENMMPSE_PARTICLEORDER_H_

#include "Threads.h"
#include "numerics/Vec3.h"
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

/**
 * New positions for some halves of the mobility at once, so that threads meet as seldom as
 * possible: each half has
 *
 *     begin(n)                 room for n particles
 *     assign(s, from, to)      keys of particles [from, to) with fractional coordinates s
 *     sort()                   serial: one half per thread
 *     place(s, from, to)       what each place of [from, to) needs to know of its particle
 *
 * @param locate  locate(from, to) makes the coordinates of particles [from, to) valid
 */
template <class Locate, class... Halves>
void placeParticles(const Threads& threads, const std::vector<numerics::Vec3>& s, Locate locate,
                    Halves&... halves) {
    const int n = static_cast<int>(s.size());
    (halves.begin(n), ...);
    threads.runBlocks(n, [&](int from, int to, int) {
        locate(from, to);
        (halves.assign(s, from, to), ...);
    });
    threads.run(sizeof...(halves), [&](int task, int) {
        int half = 0;
        ((half++ == task ? halves.sort() : void()), ...);
    });
    threads.runBlocks(n, [&](int from, int to, int) { (halves.place(s, from, to), ...); });
}

} // namespace PSE

#endif
