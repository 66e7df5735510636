/* A strictly convex quadratic program with few variables, by the dual active-set method.
 *
 * It starts at the unconstrained minimum and adds one violated side after the other to the active set, so it needs no
 * feasible point, and ends at the solution or shows that there is none.
 *
 * Source: D. Goldfarb and A. Idnani, A numerically stable dual method for solving strictly convex quadratic programs,
 * Mathematical Programming 27 (1983) 1-33.
 */
#include <math.h>

#include "screwsynth-sqp.h"

/* Largest violation of a side that counts as rounding; variables and rows are of order 1. */
#define VIOLATED 1e-13
/* Largest violation of a side dependent on the active ones that counts as rounding, for values of order 1 and relative to the
 * first d. */
#define LENIENT 1e-10
#define ROUNDING 1e-15
/* Relative size of a normal outside the span of the active ones below which it is dependent. */
#define DEPENDENT 1e-11

static inline double dot(const double *a, const double *b, int n) {
    double sum = 0.0;
    int i;
    for (i = 0; i < n; ++i) sum += a[i] * b[i];
    return sum;
}

double screwsynth_QP_dot(const double *a, const double *b, int n) {
    return dot(a, b, n);
}

/* Inactive side that d violates most, if by more than `worst`, which is negative; else -1. Sides: n lower bounds, n upper
 * bounds, lower and upper bounds of c rows. `products` receives the products of the rows and d. */
static int most_violated(const screwsynth_QP_data *q, const double *d, const int *held, double *products, double *worst) {
    const int n = q->n, c = q->c;
    double least = *worst;
    int found = -1, i;
    for (i = 0; i < n; ++i)
        if (d[i] - q->lower[i] < least && !held[i]) least = d[i] - q->lower[i], found = i;
    for (i = 0; i < n; ++i)
        if (q->upper[i] - d[i] < least && !held[n + i]) least = q->upper[i] - d[i], found = n + i;
    for (i = 0; i < c; ++i) {
        products[i] = dot(q->rows + i * n, d, n);
        if (products[i] - q->row_lower[i] < least && !held[2 * n + i])
            least = products[i] - q->row_lower[i], found = 2 * n + i;
    }
    for (i = 0; i < c; ++i)
        if (q->row_upper[i] - products[i] < least && !held[2 * n + c + i])
            least = q->row_upper[i] - products[i], found = 2 * n + c + i;
    *worst = least;
    return found;
}

static int is_equation(const screwsynth_QP_data *q, int side) {
    int j = side - 2 * q->n;
    if (side < q->n) return q->lower[side] == q->upper[side];
    return j >= 0 && j < q->c && q->row_lower[j] == q->row_upper[j];
}

/* t = J' times the inward normal of a side. */
static void along(const screwsynth_QP_data *q, int side, double sign, const double *J, double *t) {
    int n = q->n, i, k, j = side - 2 * n;
    if (j < 0) {
        i = side < n ? side : side - n;
        if (side >= n) sign = -sign;
        for (k = 0; k < n; ++k) t[k] = sign * J[i * n + k];
        return;
    }
    if (j >= q->c) {
        j -= q->c;
        sign = -sign;
    }
    for (k = 0; k < n; ++k) t[k] = 0.0;
    for (i = 0; i < n; ++i) {
        double weight = sign * q->rows[j * n + i];
        for (k = 0; k < n; ++k) t[k] += weight * J[i * n + k];
    }
}

/* Rotates columns k and k + 1 of J so that (a, b) becomes (its length, 0): a Givens rotation. */
static void turn(double *J, int n, int k, double *a, double *b, double *cosine, double *sine) {
    double length = sqrt(*a * *a + *b * *b);
    int i;
    *cosine = length > 0.0 ? *a / length : 1.0;
    *sine = length > 0.0 ? *b / length : 0.0;
    for (i = 0; i < n; ++i) {
        double first = J[i * n + k], second = J[i * n + k + 1];
        J[i * n + k] = *cosine * first + *sine * second;
        J[i * n + k + 1] = *cosine * second - *sine * first;
    }
    *a = length;
    *b = 0.0;
}

/* Removes side number l from the active set: removes column l of R, and makes R triangular again. */
static void let_go(double *J, double *R, int *active, double *u, int n, int count, int l) {
    int i, k;
    for (k = l; k + 1 < count; ++k) {
        active[k] = active[k + 1];
        u[k] = u[k + 1];
        for (i = 0; i < count; ++i) R[i * n + k] = R[i * n + k + 1];
    }
    for (k = l; k + 1 < count; ++k) {
        double cosine, sine;
        turn(J, n, k, &R[k * n + k], &R[(k + 1) * n + k], &cosine, &sine);
        for (i = k + 1; i + 1 < count; ++i) {
            double first = R[k * n + i], second = R[(k + 1) * n + i];
            R[k * n + i] = cosine * first + sine * second;
            R[(k + 1) * n + i] = cosine * second - sine * first;
        }
    }
}

int screwsynth_QP(const screwsynth_QP_data *q, double *d, double *multipliers, double *work, int *iwork) {
    const int n = q->n, sides = 2 * (q->n + q->c), most = SCREWSYNTH_QPPASSES(q->n, q->c);
    double *J = work, *R = J + n * n, *t = R + n * n, *r = t + n, *u = r + n, *products = u + n;
    int *active = iwork, *held = iwork + n;
    double lenient = LENIENT;
    int count = 0, next = 0, pass, i, k, side;

    /* J = L^-T, from the columns of the inverse of L. */
    for (i = 0; i < n * n; ++i) J[i] = R[i] = 0.0;
    for (k = 0; k < n; ++k) {
        J[k * n + k] = 1.0 / q->factor[k * n + k];
        for (i = k + 1; i < n; ++i) {
            double sum = 0.0;
            int l;
            for (l = k; l < i; ++l) sum += q->factor[i * n + l] * J[k * n + l];
            J[k * n + i] = -sum / q->factor[i * n + i];
        }
    }
    for (k = 0; k < n; ++k) t[k] = 0.0;
    for (i = 0; i < n; ++i)
        for (k = i; k < n; ++k) t[k] += J[i * n + k] * q->gradient[i];
    for (i = 0; i < n; ++i) d[i] = -dot(J + i * n + i, t + i, n - i);
    for (i = 0; i < n; ++i) lenient = fmax(lenient, ROUNDING * fabs(d[i]));
    for (side = 0; side < sides; ++side) {
        multipliers[side] = 0.0;
        held[side] = 0;
    }
    /* An equation enters by its lower side; its upper side never enters. */
    for (i = 0; i < n; ++i) held[n + i] = is_equation(q, i);
    for (k = 0; k < q->c; ++k) held[2 * n + q->c + k] = is_equation(q, 2 * n + k);

    for (pass = 0; pass < most; ++pass) {
        int entering = -1;
        double worst = -VIOLATED, sign = 1.0, fresh = 0.0;
        /* The entering side: equations first, beginning with fixed variables, because rows that these variables determine are
         * then satisfied up to rounding; then the side with the largest violation. Equations stay active. */
        for (; next < 2 * n + q->c && entering < 0; ++next) {
            if (!is_equation(q, next)) continue;
            entering = next;
            k = next - 2 * n;
            worst = k < 0 ? d[next] - q->lower[next] : dot(q->rows + k * n, d, n) - q->row_lower[k];
            if (worst > 0.0) {
                worst = -worst;
                sign = -1.0;
            }
        }
        if (entering < 0) entering = most_violated(q, d, held, products, &worst);
        if (entering < 0) {
            for (k = 0; k < count; ++k) {
                const double own = held[active[k]] * u[k];
                if (active[k] < n && own < 0.0)
                    multipliers[n + active[k]] = -own; /* a fixed variable: its upper bound */
                else
                    multipliers[active[k]] = own;
            }
            return 0;
        }
        for (;; ++pass) {
            double inside = 0.0, outside = 0.0, partial = HUGE_VAL, full = HUGE_VAL, step;
            int leaving = -1;
            if (pass >= most) return 1;
            along(q, entering, sign, J, t);
            for (k = 0; k < count; ++k) inside += t[k] * t[k];
            for (k = count; k < n; ++k) outside += t[k] * t[k];
            for (i = count - 1; i >= 0; --i) {
                double sum = t[i];
                for (k = i + 1; k < count; ++k) sum -= R[i * n + k] * r[k];
                r[i] = sum / R[i * n + i];
            }
            for (k = 0; k < count; ++k) {
                if (!(r[k] > 0.0) || u[k] / r[k] >= partial || is_equation(q, active[k])) continue;
                partial = u[k] / r[k];
                leaving = k;
            }
            if (outside > DEPENDENT * DEPENDENT * (inside + outside)) full = -worst / outside;
            if (full == HUGE_VAL && fresh == 0.0 && worst >= -lenient) {
                held[entering] = 1; /* dependent on the active sides, and satisfied with them up to rounding */
                break;
            }
            if (full == HUGE_VAL && leaving < 0) return 1; /* the sides contradict each other */
            step = full < partial ? full : partial;
            for (k = 0; k < count; ++k) u[k] -= step * r[k];
            fresh += step;
            if (full < HUGE_VAL) {
                for (i = 0; i < n; ++i) d[i] += step * dot(J + i * n + count, t + count, n - count);
                worst += step * outside;
            }
            if (full <= partial) {
                /* Rotate t until only its first component beyond the active ones remains: the new column of R. */
                for (k = n - 2; k >= count; --k) {
                    double cosine, sine;
                    turn(J, n, k, &t[k], &t[k + 1], &cosine, &sine);
                }
                for (i = 0; i <= count; ++i) R[i * n + count] = t[i];
                active[count] = entering;
                u[count] = fresh;
                held[entering] = sign > 0.0 ? 1 : -1;
                ++count;
                break;
            }
            held[active[leaving]] = 0;
            let_go(J, R, active, u, n, count, leaving);
            --count;
        }
    }
    return 1;
}
