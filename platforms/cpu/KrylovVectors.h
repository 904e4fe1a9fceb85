// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_KRYLOVVECTORS_H_
#define OPENMMPSE_KRYLOVVECTORS_H_

#include "AlignedVector.h"
#include "PairKernels.h"
#include "Threads.h"
#include <deque>
#include <numeric>
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
    std::vector<double> dots(int number, const Vector& v) const {
        std::vector<double> all(number, 0.0);
        partials.resize(size_t(number) * Threads::blocks(count));
        threads.runBlocks(count, [&](int from, int to, int task) {
            for (int k = 0; k < number; k++) // while this part of v is near
                partials[size_t(task) * number + k] =
                    kernels.dot(3 * (to - from), v.data() + 3 * size_t(from),
                                krylov[k].data() + 3 * size_t(from));
        });
        for (size_t i = 0; i < partials.size(); i++)
            all[i % number] += partials[i];
        return all;
    }
    double addScaled(double s, const Vector& v, Vector& out) const {
        return sumOverTasks([&](int from, int to, int) {
            const int n = 3 * (to - from);
            Real* const part = out.data() + 3 * size_t(from);
            kernels.addScaled(n, Real(s), v.data() + 3 * size_t(from), part);
            return kernels.dot(n, part, part);
        });
    }
    double addCombination(const std::vector<double>& coefficients, Vector& out) const {
        return sumOverTasks([&](int from, int to, int) {
            const int n = 3 * (to - from);
            Real* const part = out.data() + 3 * size_t(from);
            for (size_t k = 0; k < coefficients.size(); k++)
                kernels.addScaled(n, Real(coefficients[k]), krylov[k].data() + 3 * size_t(from),
                                  part);
            return kernels.dot(n, part, part);
        });
    }
    void clear(Vector& out) const { out.assign(krylov[0].size(), Real(0)); }

protected:
    /** The sum of what work(from, to, task) returns, in the order of the tasks. */
    template <class Work> double sumOverTasks(Work work) const {
        partials.resize(Threads::blocks(count));
        threads.runBlocks(
            count, [&](int from, int to, int task) { partials[task] = work(from, to, task); });
        return std::accumulate(partials.begin(), partials.end(), 0.0);
    }

    const Threads& threads;
    PairKernels<Real> kernels = pairKernels<Real>();

private:
    int count = 0;
    std::deque<Vector> krylov; // references to earlier vectors stay valid while it grows
    mutable std::vector<double> partials;
};

} // namespace PSE

#endif
