"""Linear algebra of matrices of two to six rows, for the kernels: no allocation, no call into LAPACK.

D is the number of rows. Where the caller's is known to the compiler, so are the loops' lengths here.
"""

from __future__ import annotations

from math import sqrt

from farhand.common.model.kernel import kernel


@kernel
def cholesky(H, D):
    """Factorise H = L L^T in place, in the lower triangle; the diagonal holds 1 / L_jj."""
    for j in range(D):
        for k in range(j):
            H[j, j] -= H[j, k] * H[j, k]
        H[j, j] = 1.0 / sqrt(H[j, j])
        for i in range(j + 1, D):
            for k in range(j):
                H[i, j] -= H[i, k] * H[j, k]
            H[i, j] *= H[j, j]


@kernel
def forward_vector(L, b, D):
    """Replace b by L^-1 b."""
    for i in range(D):
        for k in range(i):
            b[i] -= L[i, k] * b[k]
        b[i] *= L[i, i]


@kernel
def forward_columns(L, B, D):
    """Replace B by L^-1 B."""
    for i in range(D):
        for k in range(i):
            for c in range(D):
                B[i, c] -= L[i, k] * B[k, c]
        for c in range(D):
            B[i, c] *= L[i, i]


@kernel
def invert(matrix, L, out):
    """Write the inverse of a positive definite matrix to out; L is room to work in. Shapes (D, D)."""
    D = matrix.shape[0]
    for a in range(D):
        for b in range(D):
            L[a, b] = matrix[a, b]
            out[a, b] = 1.0 if a == b else 0.0
    cholesky(L, D)
    forward_columns(L, out, D)
    for i in range(D - 1, -1, -1):  # L^T out = L^-1
        for c in range(i + 1):
            for k in range(i + 1, D):
                out[i, c] -= L[k, i] * out[k, c]
            out[i, c] *= L[i, i]
            out[c, i] = out[i, c]


@kernel
def transform(Q, J, QJ):
    """Replace a symmetric Q by diag(I, J)^T Q diag(I, J). Shapes (T, T), (3, 3), room (T, 3)."""
    T = Q.shape[0]
    n = T - 3
    for a in range(T):
        for b in range(3):
            QJ[a, b] = Q[a, n] * J[0, b] + Q[a, n + 1] * J[1, b] + Q[a, n + 2] * J[2, b]
    for b in range(3):
        for a in range(n):
            Q[a, n + b] = QJ[a, b]
            Q[n + b, a] = QJ[a, b]
        for a in range(b + 1):
            total = J[0, a] * QJ[n, b] + J[1, a] * QJ[n + 1, b] + J[2, a] * QJ[n + 2, b]
            Q[n + a, n + b] = total
            Q[n + b, n + a] = total
