// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_LANCZOSSPACE_H_
#define OPENMMPSE_LANCZOSSPACE_H_

#include "numerics/Vec3.h"
#include <deque>
#include <vector>

namespace PSE {

/**
 * The vector operations of lanczosSquareRoot(), one entry per particle.
 * @tparam Multiply  multiply(v, out) makes out = M v
 */
template <class Multiply> class LanczosSpace {
public:
    using Vector = std::vector<numerics::Vec3>;
    LanczosSpace(size_t particles, Multiply multiply) : particles(particles), multiply(multiply) {}
    Vector& basis(int i) {
        while (static_cast<int>(vectors.size()) <= i)
            vectors.emplace_back(particles);
        return vectors[i];
    }
    double multiplyAdd(const Vector& v, double s, const Vector& w, double t, Vector& out) const {
        multiply(v, out);
        for (size_t i = 0; i < v.size(); i++)
            out[i] = s * out[i] + t * w[i];
        return dot(v, out);
    }
    std::vector<double> dots(int count, const Vector& v) const {
        std::vector<double> all;
        for (int k = 0; k < count; k++)
            all.push_back(dot(v, vectors[k]));
        return all;
    }
    double addScaled(double s, const Vector& v, Vector& out) const {
        for (size_t i = 0; i < v.size(); i++)
            out[i] += s * v[i];
        return dot(out, out);
    }
    double addCombination(const std::vector<double>& coefficients, Vector& out) const {
        for (size_t k = 0; k < coefficients.size(); k++)
            addScaled(coefficients[k], vectors[k], out);
        return dot(out, out);
    }
    void clear(Vector& out) const { out.assign(particles, numerics::Vec3::Zero()); }

private:
    static double dot(const Vector& v, const Vector& w) {
        double sum = 0;
        for (size_t i = 0; i < v.size(); i++)
            sum += v[i].dot(w[i]);
        return sum;
    }

    size_t particles;
    Multiply multiply;
    std::deque<Vector> vectors; // references to earlier vectors stay valid while it grows
};

} // namespace PSE

#endif
