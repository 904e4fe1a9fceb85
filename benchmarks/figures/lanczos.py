# SPDX-License-Identifier: MIT
"""The Lanczos process in NumPy for a symmetric positive matrix given as a product: the baseline of the figures."""

import numpy as np


def squareRoot(product, z, tolerance, most=300):
    """(M^{1/2} z, iterations, estimate of the relative error left), reorthogonalised.

    product    M v for a vector v (n,)
    tolerance  relative; the process stops when the change of the last iteration, continued as a geometric series with
               the larger of its last two ratios, is below it (the rule of docs/theory.md [T18])
    """
    length = np.linalg.norm(z)
    basis, alphas, betas = [z / length], [], []
    old, changes = None, []
    for m in range(1, most + 1):
        w = product(basis[-1])
        alphas.append(basis[-1] @ w)
        V = np.array(basis)
        for _ in range(2):
            w = w - V.T @ (V @ w)
        tridiagonal = np.diag(alphas) + np.diag(betas, 1) + np.diag(betas, -1)
        values, vectors = np.linalg.eigh(tridiagonal)
        root = length * (vectors * np.sqrt(np.maximum(values, 0))) @ vectors[0] @ V
        if old is not None:
            changes.append(np.linalg.norm(root - old) / (length * np.sqrt(alphas[0])))
        if len(changes) > 1:
            ratio = max(b / a for a, b in zip(changes[-3:], changes[-2:]))
            left = changes[-1] * ratio / (1 - ratio) if ratio < 1 else np.inf
            if left < tolerance:
                return root, m, left
        old = root
        beta = np.linalg.norm(w)
        if beta < 1e-14 * np.sqrt(alphas[0] ** 2 + 1e-300):
            return root, m, 0.0
        betas.append(beta)
        basis.append(w / beta)
    raise ValueError(f"no convergence to {tolerance:g} in {most} iterations; loosen the tolerance")
