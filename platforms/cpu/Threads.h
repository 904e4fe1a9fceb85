// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_THREADS_H_
#define OPENMMPSE_THREADS_H_

#include "openmm/internal/ThreadPool.h"
#include <atomic>
#include <exception>
#include <mutex>

namespace PSE {

/**
 * Runs independent tasks on OpenMM's threads. Whatever a task computes must not depend on the
 * thread it runs on, nor on how many there are: then a step gives the same bits for any number of
 * threads.
 */
class Threads {
public:
    /** @param serial  run in the calling thread: waking others costs more than a small scene */
    Threads(OpenMM::ThreadPool& pool, bool serial)
        : pool(pool), serial(serial || pool.getNumThreads() < 2) {}
    int count() const { return serial ? 1 : pool.getNumThreads(); }

    /** Call work(task, thread) once for each task in [0, tasks); the first exception is passed on.
     */
    template <class Work> void run(int tasks, Work work) const {
        if (serial || tasks < 2) {
            for (int task = 0; task < tasks; task++)
                work(task, 0);
            return;
        }
        std::atomic<int> next(0);
        std::exception_ptr error;
        std::once_flag first;
        pool.execute([&](OpenMM::ThreadPool&, int thread) {
            try {
                for (int task = next++; task < tasks; task = next++)
                    work(task, thread);
            } catch (...) {
                std::call_once(first, [&] { error = std::current_exception(); });
            }
        });
        pool.waitForThreads();
        if (error)
            std::rethrow_exception(error);
    }

    /** Call work(from, to, block) for blocks of a fixed size that cover [0, n). */
    template <class Work> void runBlocks(int n, Work work) const {
        run(blocks(n), [&](int block, int) { work(from(block), to(block, n), block); });
    }
    static int blocks(int n) { return (n + BLOCK - 1) / BLOCK; }
    static int from(int block) { return block * BLOCK; }
    static int to(int block, int n) { return n < (block + 1) * BLOCK ? n : (block + 1) * BLOCK; }

    static constexpr int BLOCK = 256;

private:
    OpenMM::ThreadPool& pool;
    bool serial;
};

} // namespace PSE

#endif
