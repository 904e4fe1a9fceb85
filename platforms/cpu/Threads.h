// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_THREADS_H_
#define OPENMMPSE_THREADS_H_

#include "TaskShare.h"
#include "openmm/internal/ThreadPool.h"
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

    /**
     * Call work(task, thread) once for each task in [0, tasks), and return when all are done; the
     * first exception is passed on. The calling thread is thread 0 and takes tasks, too.
     */
    template <class Work> void run(int tasks, Work work) const {
        if (serial || tasks < 2) {
            for (int task = 0; task < tasks; task++)
                work(task, 0);
            return;
        }
        std::exception_ptr error;
        std::once_flag first;
        const auto guarded = [&](int task, int thread) {
            try {
                work(task, thread);
            } catch (...) {
                std::call_once(first, [&] { error = std::current_exception(); });
            }
        };
        keepAwake([&] { share->run(tasks, guarded); });
        if (error)
            std::rethrow_exception(error);
    }

    /**
     * Call body(). Until it returns the other threads wait awake for the tasks of run(), which then
     * takes about a microsecond besides its tasks, not the waking of threads, which is many times
     * that; after about a millisecond without a task they doze. For many short runs one after
     * another. The pool must have no other use meanwhile.
     */
    template <class Body> void keepAwake(Body body) const {
        if (serial || share != nullptr) {
            body();
            return;
        }
        TaskShare mine;
        pool.execute([&mine](OpenMM::ThreadPool&, int thread) {
            if (thread > 0) // the calling thread stands for thread 0
                mine.serve(thread);
        });
        share = &mine;
        const struct End { // by an exception, too
            const Threads& threads;
            ~End() {
                threads.share->end();
                threads.share = nullptr;
                threads.pool.waitForThreads();
            }
        } end = {*this};
        body();
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
    mutable TaskShare* share = nullptr; ///< while threads are kept awake
};

} // namespace PSE

#endif
