/* The step of a search by sequential quadratic programming: the Hessian of the Lagrangian along the active sides, its shift
 * to a positive definite matrix, and the quadratic program. See screwsynth-search.h.
 */
#include <math.h>

#include "screwsynth-search.h"

#define LEAST 1e-8        /* smallest first shift, relative to the curvature */
#define FLAT 1e-6         /* assumed curvature of a linear function */
#define CURVED 1e-7       /* relative size from which on a negative curvature counts as negative */
#define PARTS 6           /* number of trial fractions of the way to contradicting bounds: a quadratic program for each */
#define ROUNDED 1e-13     /* size up to which a negative curvature of f, of order 1, may be rounding error */

double screwsynth_SQP_largest(const double *values, int n) {
    double size = 0.0;
    int i;
    for (i = 0; i < n; ++i)
        if (!(fabs(values[i]) <= size)) size = fabs(values[i]);
    return size;
}

double screwsynth_SQP_outside(const screwsynth_SQP_problem *p, int j, double g) {
    if (g < p->g_lower[j]) return p->g_lower[j] - g;
    return g > p->g_upper[j] ? g - p->g_upper[j] : 0.0;
}

double screwsynth_SQP_violation(const screwsynth_SQP_problem *p, const double *g) {
    double most = 0.0;
    int j;
    for (j = 0; j < p->c; ++j)
        if (!(screwsynth_SQP_outside(p, j, g[j]) <= most)) most = screwsynth_SQP_outside(p, j, g[j]);
    return most;
}

/* Lower triangle L of M + shift I = LL'. Returns n, or the index of the first pivot that is not above least. */
static int cholesky(const double *M, double *L, int n, double shift, double least, double *pivot) {
    int i, j;
    for (i = 0; i < n; ++i) {
        for (j = 0; j <= i; ++j) {
            double sum = M[i * n + j] - screwsynth_QP_dot(L + i * n, L + j * n, j);
            if (j < i) {
                L[i * n + j] = sum / L[j * n + j];
                continue;
            }
            sum += shift;
            *pivot = sum;
            if (!(sum > least)) return i;
            L[i * n + i] = sqrt(sum);
        }
    }
    return n;
}

/* Orthonormal basis of the gradients of the active rows, without active variables. sides: multipliers or marks, nonzero for
 * an active side. Returns the number of its vectors; `free` is the number of directions along all active sides. */
static int span(const screwsynth_SQP_problem *p, const point *at, const double *sides, double *basis, int *free) {
    const int n = p->n, c = p->c;
    int count = 0, i, j, k;
    *free = n;
    for (i = 0; i < n; ++i) *free -= sides[i] != 0.0 || sides[n + i] != 0.0;
    for (j = 0; j < c && *free > 0; ++j) {
        double *v = basis + count * n, length, before;
        if (sides[2 * n + j] == 0.0 && sides[2 * n + c + j] == 0.0 && p->g_lower[j] < p->g_upper[j]) continue;
        for (i = 0; i < n; ++i) v[i] = sides[i] == 0.0 && sides[n + i] == 0.0 ? at->rows[j * n + i] : 0.0;
        before = sqrt(screwsynth_QP_dot(v, v, n));
        for (k = 0; k < count; ++k) {
            double part = screwsynth_QP_dot(v, basis + k * n, n);
            for (i = 0; i < n; ++i) v[i] -= part * basis[k * n + i];
        }
        length = sqrt(screwsynth_QP_dot(v, v, n));
        if (!(length > 1e-8 * before)) continue;
        for (i = 0; i < n; ++i) v[i] /= length;
        ++count;
        --*free;
    }
    return count;
}

/* Restricts H to the directions along the active sides, with curvature `size` across them. Returns the largest entry of the
 * restricted H. */
static double reduce(int n, const double *sides, const double *basis, int count, double size, double *H, double *w) {
    double free_size;
    int i, j, k;
    for (i = 0; i < n; ++i) {
        if (sides[i] == 0.0 && sides[n + i] == 0.0) continue;
        for (k = 0; k < n; ++k) H[i * n + k] = H[k * n + i] = 0.0;
    }
    for (j = 0; j < count; ++j) {
        const double *v = basis + j * n;
        double length;
        for (i = 0; i < n; ++i) w[i] = screwsynth_QP_dot(H + i * n, v, n);
        length = screwsynth_QP_dot(v, w, n);
        for (i = 0; i < n; ++i)
            for (k = 0; k < n; ++k) H[i * n + k] += length * v[i] * v[k] - w[i] * v[k] - v[i] * w[k];
    }
    free_size = screwsynth_SQP_largest(H, n * n);
    for (i = 0; i < n; ++i)
        if (sides[i] != 0.0 || sides[n + i] != 0.0) H[i * n + i] = size;
    for (j = 0; j < count; ++j)
        for (i = 0; i < n; ++i)
            for (k = 0; k < n; ++k) H[i * n + k] += size * basis[j * n + i] * basis[j * n + k];
    return free_size;
}

int screwsynth_SQP_curve(search *of) {
    const int n = of->p->n;
    int free, i;
    const int count = span(of->p, &of->at, of->u, of->basis, &free);
    int is_flat;
    double size;
    /* No direction is along all active sides: the curvature across them may be as large as at the last point. */
    if (free == 0 && of->curvature > 0.0) {
        for (i = 0; i < n * n; ++i) of->H[i] = i % (n + 1) == 0 ? of->curvature : 0.0;
        of->size = of->free_size = 1e-10 * of->curvature;
        return 0;
    }
    if (of->p->hessian(of->p->self, of->at.s, 1.0, of->carried, of->H)) return 1;
    size = screwsynth_SQP_largest(of->H, n * n);
    is_flat = !(size > FLAT);
    if (is_flat) size = FLAT;
    else
        of->curvature = size;
    of->free_size = reduce(n, of->u, of->basis, count, size, of->H, of->spare);
    /* Below this value, the curvature is rounding error of the whole Hessian. */
    if (!(of->free_size > 1e-10 * size)) of->free_size = 1e-10 * size;
    /* A linear f, such as a level without active constraints, has no curvature as a scale of shifts. The scale of the variables
     * keeps the quadratic program's unconstrained minimum near enough for its rounding error. */
    of->size = is_flat ? 1.0 : of->free_size;
    return 0;
}

int screwsynth_SQP_factorise(search *of) {
    const int n = of->p->n;
    const double most = 10.0 * n * of->size; /* n times the largest entry is enough for finite values */
    const double least = of->size > of->free_size ? MILD : LEAST; /* for a linear f, because no residual gives a better value */
    const double first = fmin(fmax(of->residual, least * of->size), MILD * of->size);
    double pivot;
    int i;
    of->shift = of->damping * of->size;
    while (cholesky(of->H, of->L, n, of->shift, 1e-10 * of->size, &pivot) < n) {
        if (!(of->shift <= most)) return 1;
        of->shift = fmax(3.0 * of->shift, first);
    }
    for (i = 0; of->unit != 1.0 && i < n * n; ++i) of->L[i] *= sqrt(of->unit);
    return 0;
}

void screwsynth_SQP_limit_step(search *of, double part, const double *bent) {
    const screwsynth_SQP_problem *p = of->p;
    int i, j;
    for (i = 0; i < p->n; ++i) {
        of->low[i] = (p->lower[i] - of->at.s[i]) / of->unit;
        of->high[i] = (p->upper[i] - of->at.s[i]) / of->unit;
    }
    for (j = 0; j < p->c; ++j) {
        double low = p->g_lower[j] - of->at.g[j], high = p->g_upper[j] - of->at.g[j], off = bent ? bent[j] : 0.0;
        if (p->g_lower[j] == p->g_upper[j]) {
            of->row_low[j] = of->row_high[j] = (part * low - off) / of->unit;
            continue;
        }
        of->row_low[j] = ((low > 0.0 ? part * low : low) - off) / of->unit;
        of->row_high[j] = ((high < 0.0 ? part * high : high) - off) / of->unit;
    }
}

int screwsynth_SQP_step_within(search *of, double *d, double *u) {
    int i;
    if (screwsynth_QP(&of->q, d, u, of->qp_work, of->qp_iwork)) return 1;
    for (i = 0; i < of->p->n; ++i) d[i] *= of->unit;
    return 0;
}

int screwsynth_SQP_find_step(search *of) {
    static const double parts[PARTS] = {1.0, 0.25, 0.0625, 0.015625, 0.00390625, 0.0};
    const int n = of->p->n, c = of->p->c;
    const int last = PARTS - 1;
    int failed = 1, i, j;
    of->q.gradient = of->at.gradient;
    of->q.rows = of->at.rows;
    for (i = 0; failed && i <= last; ++i) {
        of->part = parts[i];
        /* The violation of a feasible point may exceed narrow bounds: then the step reduces it by a fraction of these. */
        if (i == 1 && of->is_feasible) {
            of->part *= of->unit / fmax(screwsynth_SQP_violation(of->p, of->at.g), of->unit);
            i = last - 1;
        }
        screwsynth_SQP_limit_step(of, of->part, 0);
        failed = screwsynth_SQP_step_within(of, of->d, of->u);
    }
    for (j = 0; j < c; ++j) of->carried[j] = of->u[2 * n + c + j] - of->u[2 * n + j];
    return failed;
}

int screwsynth_SQP_saddle_row(search *of) {
    const int n = of->p->n;
    double pivot;
    int i, k;
    for (i = 0; i < n; ++i) {
        double half = 0.5 * (of->p->upper[i] - of->p->lower[i]);
        if (half >= NARROW) continue;
        for (k = 0; k < n; ++k) {
            of->H[i * n + k] *= half / NARROW;
            of->H[k * n + i] *= half / NARROW;
        }
    }
    return cholesky(of->H, of->L, of->p->n, fmax(CURVED * of->free_size, ROUNDED), 0.0, &pivot);
}
