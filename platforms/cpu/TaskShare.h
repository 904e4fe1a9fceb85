// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_TASKSHARE_H_
#define OPENMMPSE_TASKSHARE_H_

#include <atomic>
#include <chrono>
#include <hwy/cache_control.h>
#include <thread>

namespace PSE {

/**
 * Tasks that threads which stay awake take from one another: one thread gives them out by run(),
 * the others are in serve() until end().
 */
class TaskShare {
public:
    /**
     * Call work(task, thread) once for each task in [0, tasks), here as thread 0 and in the threads
     * that serve, and return when all are done.
     * @param work  must not throw
     */
    template <class Work> void run(int tasks, const Work& work) {
        // nobody reads these two: every task of an earlier run is done
        call = [](const void* what, int task, int thread) {
            (*static_cast<const Work*>(what))(task, thread);
        };
        what = &work;
        unfinished.store(tasks, std::memory_order_relaxed);
        untaken.store(tasks, std::memory_order_release);
        takeTasks(0);
        for (Patience patience; unfinished.load(std::memory_order_acquire) > 0;)
            patience.wait();
    }
    /** Do tasks as thread number `thread` until end(). */
    void serve(int thread) {
        for (Patience patience; !over.load(std::memory_order_acquire);) {
            if (takeTasks(thread))
                patience = Patience();
            else
                patience.wait();
        }
    }
    void end() { over.store(true, std::memory_order_release); }

private:
    /**
     * Waits between two looks: at first as shortly as it can, then others may have the core, and
     * after about a millisecond it sleeps, so that many threads with little to do use no more than
     * their share of a machine.
     */
    class Patience {
    public:
        void wait() {
            looks++;
            if (looks < SHORT_LOOKS)
                hwy::Pause();
            else if (looks < MOST_LOOKS)
                std::this_thread::yield();
            else
                std::this_thread::sleep_for(std::chrono::microseconds(50));
        }

    private:
        static constexpr int SHORT_LOOKS = 1000, MOST_LOOKS = 3000;
        int looks = 0;
    };

    /** @return whether there was a task */
    bool takeTasks(int thread) {
        bool any = false;
        int left = untaken.load(std::memory_order_relaxed);
        while (left > 0)
            if (untaken.compare_exchange_weak(left, left - 1, std::memory_order_acquire,
                                              std::memory_order_relaxed)) {
                call(what, left - 1, thread);
                unfinished.fetch_sub(1, std::memory_order_release);
                any = true;
                left = untaken.load(std::memory_order_relaxed);
            }
        return any;
    }

    void (*call)(const void* what, int task, int thread) = nullptr;
    const void* what = nullptr;
    std::atomic<int> untaken{0}, unfinished{0};
    std::atomic<bool> over{false};
};

} // namespace PSE

#endif
