// SPDX-License-Identifier: MIT
// Tasks on threads: each is done once, whether threads are woken for it or kept awake, and an
// exception of a task reaches the caller and spoils nothing that comes after.

#include "Threads.h"
#include <atomic>
#include <gtest/gtest.h>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

using PSE::Threads;

namespace {

constexpr int NUM_THREADS = 4, TASKS = 37;

class CpuThreads : public testing::Test {
protected:
    /** Run TASKS tasks; each must be done once, by a thread that counts itself among all. */
    void expectAllDoneOnce() {
        std::vector<std::atomic<int>> done(TASKS);
        std::atomic<bool> inRange(true);
        threads.run(TASKS, [&](int task, int thread) {
            done[task]++;
            if (thread < 0 || thread >= threads.count())
                inRange = false;
        });
        for (const auto& times : done)
            ASSERT_EQ(times, 1);
        ASSERT_TRUE(inRange);
    }
    /** @return what is thrown when one task in the middle fails */
    std::string messageOfFailure() {
        std::atomic<int> done(0);
        std::string message;
        try {
            threads.run(TASKS, [&](int task, int) {
                if (task == TASKS / 2)
                    throw std::runtime_error("task in the middle");
                done++;
            });
        } catch (const std::runtime_error& e) {
            message = e.what();
        }
        EXPECT_EQ(done, TASKS - 1); // the others are not left out
        return message;
    }

    OpenMM::ThreadPool pool{NUM_THREADS};
    Threads threads{pool, false};
};

TEST_F(CpuThreads, EveryTaskOnce) {
    for (int i = 0; i < 200; i++)
        expectAllDoneOnce();
}

TEST_F(CpuThreads, EveryTaskOnceByThreadsKeptAwake) {
    threads.keepAwake([&] {
        for (int i = 0; i < 5000; i++)
            expectAllDoneOnce();
        threads.keepAwake([&] { expectAllDoneOnce(); }); // one within the other: as one
        expectAllDoneOnce();
    });
    expectAllDoneOnce();
}

TEST_F(CpuThreads, TasksRunInSeveralThreads) {
    std::vector<std::thread::id> who(NUM_THREADS);
    std::atomic<int> arrived(0);
    threads.run(NUM_THREADS, [&](int task, int) {
        who[task] = std::this_thread::get_id();
        arrived++;
        while (arrived < NUM_THREADS) // nobody does two of them
            std::this_thread::yield();
    });
    EXPECT_EQ(std::set<std::thread::id>(who.begin(), who.end()).size(), size_t(NUM_THREADS));
}

TEST_F(CpuThreads, AnExceptionOfATaskReachesTheCaller) {
    EXPECT_EQ(messageOfFailure(), "task in the middle");
    expectAllDoneOnce();
    threads.keepAwake([&] {
        EXPECT_EQ(messageOfFailure(), "task in the middle");
        expectAllDoneOnce();
    });
}

TEST_F(CpuThreads, AnExceptionEndsWakefulness) {
    EXPECT_THROW(threads.keepAwake([&] {
        expectAllDoneOnce();
        throw std::invalid_argument("between two runs");
    }),
                 std::invalid_argument);
    expectAllDoneOnce();
    threads.keepAwake([&] { expectAllDoneOnce(); });
}

TEST_F(CpuThreads, OneThreadDoesAllItself) {
    const Threads alone(pool, true);
    EXPECT_EQ(alone.count(), 1);
    std::set<std::thread::id> who;
    alone.keepAwake([&] {
        alone.run(TASKS, [&](int, int thread) {
            who.insert(std::this_thread::get_id());
            EXPECT_EQ(thread, 0);
        });
    });
    EXPECT_EQ(who, std::set<std::thread::id>{std::this_thread::get_id()});
}

} // namespace
