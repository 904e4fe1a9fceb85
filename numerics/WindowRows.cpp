// SPDX-License-Identifier: MIT
#include "numerics/WindowRows.h"
#include "numerics/Quadrature.h"
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

namespace {

/// quadrature along and across rows, and Chebyshev points that polynomials are fitted to
constexpr int NODES = 40, SAMPLES = 33;
/// of the squared error: for the terms left out, the rest for the degree
constexpr double TERMS_SHARE = 0.7;
constexpr int LOWEST_DEGREE = 3;

/** S_a at the nodes of both directions, and what it is in a basis of a few functions of each. */
class Expansion {
public:
    Expansion(const RadialWindow& window, double a)
        : window(window), a(a), reach(window.reach(a)), rule(gaussLegendre(NODES, 0, reach)) {
        values.resize(NODES, NODES);
        for (int p = 0; p < NODES; p++)
            for (int q = 0; q < NODES; q++)
                values(p, q) = root(p) * at(rule.nodes[p], rule.nodes[q]) * ring(q);
        eigen.compute(values.transpose() * values);
    }

    double square() const { return values.squaredNorm(); }
    /** Of the terms beyond the first ones. */
    double squareBeyond(int terms) const {
        return std::max(0.0, eigen.eigenvalues().head(NODES - terms).sum());
    }
    /** The functions of both directions at squared distances, one column for each term. */
    void sample(int terms, const std::vector<double>& squares, Eigen::MatrixXd& across,
                Eigen::MatrixXd& along) const {
        const int n = static_cast<int>(squares.size());
        Eigen::MatrixXd ofRows(n, NODES), ofPoints(n, NODES);
        for (int s = 0; s < n; s++)
            for (int q = 0; q < NODES; q++) {
                const double value = at(std::sqrt(squares[s]), rule.nodes[q]);
                ofPoints(s, q) = value * ring(q);
                ofRows(s, q) = value * root(q);
            }
        // The largest eigenvalues are the last ones.
        const Eigen::MatrixXd right = eigen.eigenvectors().rightCols(terms).rowwise().reverse();
        const Eigen::VectorXd squared = eigen.eigenvalues().tail(terms).reverse();
        along = ofPoints * right;
        across = ofRows * (values * right) * squared.cwiseInverse().asDiagonal();
    }
    /** Of polynomials instead of the functions, over the whole cylinder. */
    double squaredError(const WindowRows& rows) const {
        Eigen::MatrixXd across(NODES, rows.terms()), along(NODES, rows.terms());
        for (int j = 0; j < rows.terms(); j++)
            for (int q = 0; q < NODES; q++) {
                const double t = rows.scale * rule.nodes[q] * rule.nodes[q] - 1;
                along(q, j) = root(q) * rows.along[j](t);
                across(q, j) = ring(q) * rows.across[j](t);
            }
        return (along * across.transpose() - values).squaredNorm();
    }
    double scale() const { return 2 / (reach * reach); }

private:
    double at(double d, double z) const { return window(std::sqrt(d * d + z * z), a); }
    /** Roots of the weights along a row, and across, where each distance stands for a ring. */
    double root(int q) const { return std::sqrt(rule.weights[q]); }
    double ring(int q) const { return std::sqrt(rule.weights[q] * rule.nodes[q]); }

    const RadialWindow& window;
    double a, reach;
    Quadrature rule;
    Eigen::MatrixXd values; ///< [along][across], weighted
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen;
};

} // namespace

double WindowRows::operator()(double d, double z) const {
    double sum = 0;
    for (int j = 0; j < terms(); j++)
        sum += across[j](scale * d * d - 1) * along[j](scale * z * z - 1);
    return sum;
}

WindowRows windowRows(const RadialWindow& window, double a, double maxError) {
    const Expansion expansion(window, a);
    const double allowed = maxError * maxError * expansion.square();
    WindowRows rows = {expansion.scale(), {}, {}};
    int terms = 1;
    while (terms <= WindowRows::MOST_TERMS && expansion.squareBeyond(terms) > TERMS_SHARE * allowed)
        terms++;
    if (terms > WindowRows::MOST_TERMS)
        return rows;
    std::vector<double> squares;
    for (int s = 0; s < SAMPLES; s++)
        squares.push_back(std::max(0.0, (1 + chebyshevPoint(s, SAMPLES)) / rows.scale));
    Eigen::MatrixXd across, along;
    expansion.sample(terms, squares, across, along);
    const auto fitted = [&](const Eigen::MatrixXd& samples, int degree) {
        std::vector<Polynomial> functions;
        for (int j = 0; j < terms; j++) {
            const std::vector<double> column(samples.col(j).data(),
                                             samples.col(j).data() + SAMPLES);
            std::vector<double> series = fitPolynomial(column, 0, SAMPLES - 1).chebyshev;
            series.resize(degree + 1);
            functions.push_back(fromChebyshev(series));
        }
        return functions;
    };
    for (int degree = LOWEST_DEGREE; degree <= WindowRows::MAX_DEGREE; degree++) {
        rows.across = fitted(across, degree);
        rows.along = fitted(along, degree);
        if (expansion.squaredError(rows) <= allowed)
            return rows;
    }
    return {expansion.scale(), {}, {}};
}

} // namespace PSE::numerics
