/* Upper models of the Lagrangian over one box, and their bounds.
 * Reference in NumPy: tests/reference/numpy_engine/bounding.py and tests/reference/numpy_engine/quadratic_models.py. */
#ifndef QUADRATIC_H
#define QUADRATIC_H

#include "values.h"

#define MULTIPLIER_ROUNDS 8
#define TANGENT_ROUNDS 3
#define LARGEST_WEIGHT 1e20 /* tests/reference/numpy_engine/quadratic_models.py */

/* Enclosures of the expressions over one box, and an upper model middle + b e + 1/2 e'He + w |e| of a weighted sum. */
typedef struct {
    int n, J, R;
    int is_second;                        /* whether the expressions have second-order forms; else their gradients have forms */
    double *centre, *radius;              /* (n) centre and radii of the box */
    double *c, *p, *q, *s, *lo, *hi;      /* (R) enclosures of the expressions */
    double *gb, *gA, *gp, *gq, *gs;       /* (R, n), gA: (R, n, n): gradients at the centre and matrices; forms of gradients, times r_i */
    double *slope_lo, *slope_hi;  /* (R, n) interval gradients, times r_i */
    double *grad_lo, *grad_hi;    /* (R, n) interval gradients */
    double *weights, *size, *left;              /* (R), (R), (n) */
    double *qb, *qw, *qlo, *qhi, *H;            /* (n), H: (n, n): the Lagrangian's model */
    double *sign, *fb, *fw, *fH, *diagonal, *t, *gradient; /* (n), fH: (n, n) */
    double *e_lo, *e_hi;
    int *why_lo, *why_hi;
    double q_middle, q_rounding;
    int squares;          /* whether functions have quotients, with models in gb, gA and gs: quotients.h */
    double *aE, *HN, *HD, *bN, *bD, *wN, *wD; /* (n), HN and HD: (n, n) */
} Box;

/* Allocates a box with E rows in the working memory. */
static Box lay_box(int variables, size_t E, Room *room)
{
    Box x = {.n = variables};
    size_t n = (size_t)variables;
    double **rows[] = {&x.c, &x.p, &x.q, &x.s, &x.lo, &x.hi, &x.weights, &x.size};
    double **vectors_of_rows[] = {&x.gb, &x.gp, &x.gq, &x.gs, &x.slope_lo, &x.slope_hi, &x.grad_lo, &x.grad_hi};
    double **vectors[] = {&x.centre, &x.radius, &x.left, &x.qb, &x.qw, &x.qlo, &x.qhi, &x.sign, &x.fb, &x.fw, &x.diagonal,
                          &x.t, &x.gradient, &x.e_lo, &x.e_hi, &x.aE, &x.bN, &x.bD, &x.wN, &x.wD};
    double **matrices[] = {&x.H, &x.fH, &x.HN, &x.HD};
    CARVE(rows, E);
    CARVE(vectors_of_rows, E * n);
    CARVE(vectors, n);
    CARVE(matrices, n * n);
    x.gA = carve(room, E * n * n);
    x.why_lo = (int *)carve(room, n), x.why_hi = (int *)carve(room, n);
    return x;
}

/* Sum of the absolute values of all terms of a second-order form. */
static double size_of_row(const Box *x, int r)
{
    int n = x->n;
    double size = fabs(x->c[r]) + (x->q[r] - x->p[r]) + x->s[r];
    for (int i = 0; i < n; i++)
        size += fabs(x->gb[r * n + i]);
    for (int i = 0; i < n * n; i++)
        size += fabs(x->gA[r * n * n + i]);
    return size;
}

/* Multipliers that make the gradient small in the variables from index first on; rounding errors come from the gradients'
 * forms, or from the values: multipliers in tests/reference/numpy_engine/quadratic_models.py. */
static void choose_multipliers(Box *x, const int *equation, int first)
{
    int n = x->n, J = x->J, R = x->R, m = x->is_second ? 1 : n;
    const double *rounding = x->is_second ? x->s : x->gs;
    for (int r = 0; r < R; r++) {
        x->weights[r] = r == 0;
        x->size[r] = 0.0;
        for (int i = first; i < n; i++) {
            double along = x->gb[r * n + i] - (r < J ? x->gb[i] : 0.0);
            x->size[r] += along * along;
        }
        double lost = 0.0;
        for (int i = first; i < m; i++)
            lost += rounding[r * m + i] * rounding[r * m + i];
        if (r >= J && !(x->size[r] > lost))
            x->size[r] = 0.0;
    }
    memcpy(x->left, x->gb, (size_t)n * sizeof(double));
    for (int round = 0; round < (R > 1 ? MULTIPLIER_ROUNDS : 0); round++)
        for (int r = 1; r < R; r++) {
            /* A redundant condition has no weight; its mark is 2 instead of 0 or 1. */
            if (!(x->size[r] > 0 && x->size[r] < INFINITY && (r < J || x->hi[r] >= 0)) || equation[r] == 2)
                continue;
            double product = 0.0, weight = x->weights[r];
            for (int i = first; i < n; i++)
                product += (x->gb[r * n + i] - (r < J ? x->gb[i] : 0.0)) * x->left[i];
            double new = weight - product / x->size[r];
            if (r < J)
                new = smaller(larger(new, 0.0), weight + x->weights[0]);
            else if (!equation[r])
                new = smaller(new, 0.0);
            if (!(fabs(new) < LARGEST_WEIGHT))
                continue;
            double change = new - weight;
            for (int i = first; i < n; i++)
                x->left[i] += change * (x->gb[r * n + i] - (r < J ? x->gb[i] : 0.0));
            x->weights[r] = new;
            if (r < J)
                x->weights[0] = larger(x->weights[0] - change, 0.0);
        }
    double sum = 0.0;
    for (int r = 0; r < J; r++)
        sum += x->weights[r];
    x->weights[0] += 1.0 - sum;
    if (x->weights[0] < 0)
        for (int r = 0; r < J; r++)
            x->weights[r] = r == 0;
}

/* One variable's part of a model, from a gradient's form and the absolute values of terms that cancelled in it:
 * integral in tests/reference/numpy_engine/quadratic_models.py. */
static double finish_model(double *b, double *w, double *low, double *high, double across, double p, double q, double s,
                           double size)
{
    double margin = 64 * ULP * (fabs(*b) + across + q - p + s + size) + TINY;
    double least = *b - across + p - s, most = *b + across + q + s;
    *low = (*low > least || isnan(least) ? *low : least) - margin;
    *high = (*high < most || isnan(most) ? *high : most) + margin;
    double lost = fabs(*b) + 2 * across + q - p + s;
    *w = (q - p) / 6 + s, *b = *b + (p + q) / 6;
    return lost;
}

/* Upper model of the weighted sum of the rows; with second-order forms its remainder is constant. */
static void combine(Box *x)
{
    int n = x->n, R = x->R;
    double largest = 0.0, lost = 0.0, middle = 0.0, error = 0.0;
    for (int r = 0; r < R; r++)
        if (x->weights[r] != 0) {
            double weight = x->weights[r], size = fabs(weight);
            middle += x->c[r] * weight, error += x->s[r] * size;
            error += x->is_second ? (weight > 0 ? x->q[r] : x->p[r]) * weight : 0.0;
            largest += (x->is_second ? size_of_row(x, r) : fabs(x->c[r])) * size;
        }
    x->q_middle = middle + error;
    for (int i = 0; i < n; i++) {
        double b = 0.0, s = 0.0, p = 0.0, q = 0.0, across = 0.0;
        double low = x->is_second ? -INFINITY : 0.0, high = -low, *H = x->H + i * n;
        memset(H, 0, (size_t)n * sizeof(double));
        for (int r = 0; r < R; r++) {
            double weight = x->weights[r];
            int at = r * n + i, up = weight > 0;
            if (weight == 0)
                continue;
            b += x->gb[at] * weight;
            for (int j = 0; j < n; j++)
                H[j] += x->gA[at * n + j] * weight;
            if (x->is_second)
                continue;
            s += x->gs[at] * fabs(weight), p += (up ? x->gp[at] : x->gq[at]) * weight, q += (up ? x->gq[at] : x->gp[at]) * weight;
            low += (up ? x->slope_lo[at] : x->slope_hi[at]) * weight;
            high += (up ? x->slope_hi[at] : x->slope_lo[at]) * weight;
        }
        for (int j = 0; j < n; j++)
            across += fabs(H[j]);
        x->qb[i] = b, x->qlo[i] = low, x->qhi[i] = high;
        lost += finish_model(x->qb + i, x->qw + i, x->qlo + i, x->qhi + i, across, p, q, s, x->is_second ? largest : 0.0);
        if (x->squares) { /* the linear part belongs to an upper model; only the other enclosure has the slopes */
            double margin = 64 * ULP * (fabs(b) + across + q - p + s) + TINY;
            x->qlo[i] = low - margin, x->qhi[i] = high + margin;
        }
    }
    x->q_rounding = 64 * ULP * (largest + lost) + TINY;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            x->H[i * n + j] = x->H[j * n + i] = 0.5 * (x->H[i * n + j] + x->H[j * n + i]);
}

/* Maximum of linear t + 1/2 quadratic t^2 for t in [0, 1]; linear is not negative. */
static double largest_of(double linear, double quadratic)
{
    if (quadratic < 0 && linear < -quadratic)
        return linear * (linear / (-2 * quadratic)); /* tested first, as the square may underflow */
    return linear + 0.5 * quadratic;
}

static double quadratic_bound(Box *x)
{
    int n = x->n;
    double fixed = x->q_middle, separate = 0.0, shifts = 0.0, plane = 0.0;
    for (int i = 0; i < n; i++)
        x->sign[i] = x->qlo[i] >= 0 ? 1.0 : x->qhi[i] <= 0 ? -1.0 : 0.0;
    for (int i = 0; i < n; i++) {
        double Hs = 0.0;
        for (int j = 0; j < n; j++)
            Hs += x->H[i * n + j] * x->sign[j];
        fixed += x->qb[i] * x->sign[i] + 0.5 * (x->sign[i] * Hs) + x->qw[i] * fabs(x->sign[i]);
        x->fb[i] = x->sign[i] == 0 ? x->qb[i] + Hs : 0.0;
        x->fw[i] = x->sign[i] == 0 ? x->qw[i] : 0.0;
    }
    for (int i = 0; i < n; i++) {
        double others = 0.0;
        for (int j = 0; j < n; j++) {
            x->fH[i * n + j] = x->sign[i] == 0 && x->sign[j] == 0 ? x->H[i * n + j] : 0.0;
            others += i == j ? 0.0 : fabs(x->fH[i * n + j]);
        }
        double diagonal = x->fH[i * n + i], shift = larger(diagonal + others, 0.0);
        separate += largest_of(fabs(x->fb[i]) + x->fw[i], diagonal) + 0.5 * others;
        shifts += 0.5 * shift + x->fw[i];
        x->diagonal[i] = diagonal - shift;
        x->t[i] = 0.0, x->gradient[i] = x->fb[i];
    }
    for (int round = 0; round < TANGENT_ROUNDS; round++)
        for (int i = 0; i < n; i++) {
            double curvature = x->diagonal[i], slope = x->gradient[i];
            double new = curvature < 0 ? x->t[i] - slope / curvature : (double)((slope > 0) - (slope < 0));
            new = isfinite(new) ? smaller(larger(new, -1.0), 1.0) : 0.0;
            double change = new - x->t[i];
            x->t[i] = new;
            if (change != 0) {
                for (int j = 0; j < n; j++)
                    x->gradient[j] += change * x->fH[i * n + j];
                x->gradient[i] += change * (curvature - x->fH[i * n + i]);
            }
        }
    for (int i = 0; i < n; i++) {
        double Ct = (x->diagonal[i] - x->fH[i * n + i]) * x->t[i];
        for (int j = 0; j < n; j++)
            Ct += x->fH[i * n + j] * x->t[j];
        plane += fabs(x->fb[i] + Ct) - 0.5 * (x->t[i] * Ct);
    }
    double one = fixed + separate, other = fixed + plane + shifts, best = one < INFINITY ? one : INFINITY;
    return (other < best ? other : best) + x->q_rounding;
}

#endif
