// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_KRYLOVVECTORS_H_
#define OPENMMPSE_KRYLOVVECTORS_H_

#include "AlignedVector.h"
#include "PairKernels.h"
#include "Threads.h"
#include <algorithm>
#include <deque>
#include <vector>

namespace PSE {

/**
 * The vector operations of lanczosSquareRoot() on the CPU, but for the product. Vectors hold three
 * numbers for each of n places; sums are taken block by block, in an order of their own.
 */
template <class Real> class KrylovVectors {
public:
    using Vector = AlignedVector<Real>;

    explicit KrylovVectors(const Threads& threads) : threads(threads) {}
    /** @param places  n */
    void resize(int places) { count = places; }
    /** Vector number i; all of them can be read one number beyond their end. */
    Vector& basis(int i) {
        while (static_cast<int>(krylov.size()) <= i)
            krylov.emplace_back();
        krylov[i].resize(3 * size_t(count) + 1);
        return krylov[i];
    }
    double dot(const Vector& v, const Vector& w) const {
        return sumOverTasks([&](int from, int to, int) {
            return kernels.dot(3 * (to - from), v.data() + 3 * size_t(from),
                               w.data() + 3 * size_t(from));
        });
    }
    double addScaled(double s, const Vector& v, Vector& out) const {
        return sumOverTasks([&](int from, int to, int) {
            return kernels.addScaled(3 * (to - from), Real(s), v.data() + 3 * size_t(from),
                                     out.data() + 3 * size_t(from));
        });
    }
    void combine(const std::vector<double>& coefficients, Vector& out) const {
        threads.runBlocks(count, [&](int from, int to, int) {
            std::fill(out.begin() + 3 * size_t(from), out.begin() + 3 * size_t(to), Real(0));
            for (size_t k = 0; k < coefficients.size(); k++)
                for (size_t i = 3 * size_t(from); i < 3 * size_t(to); i++)
                    out[i] += Real(coefficients[k]) * krylov[k][i];
        });
    }

protected:
    /** The sum of what work(from, to, task) returns, in the order of the tasks. */
    template <class Work> double sumOverTasks(Work work) const {
        return sumOverTasks(threads, work);
    }
    template <class Work> double sumOverTasks(const Threads& workers, Work work) const {
        partial.resize(Threads::blocks(count));
        workers.runBlocks(
            count, [&](int from, int to, int task) { partial[task] = work(from, to, task); });
        double total = 0;
        for (double sum : partial)
            total += sum;
        return total;
    }

    const Threads& threads;
    PairKernels<Real> kernels = pairKernels<Real>();

private:
    int count = 0;
    std::deque<Vector> krylov; // references to earlier vectors stay valid while it grows
    mutable std::vector<double> partial;
};

} // namespace PSE

#endif
