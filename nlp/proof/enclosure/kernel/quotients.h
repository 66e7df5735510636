/* Models of sums of squared quotients N^2 / D from models of N and D.
 * Reference in NumPy: tests/reference/numpy_engine/squared_quotients.py. */
#ifndef QUOTIENTS_H
#define QUOTIENTS_H

#include "quadratic.h"

#define SUM (64 * ULP)
#define LEAST 1e-20 /* tests/reference/numpy_engine/squared_quotients.py */

/* Model c + b e + 1/2 e'He +- w |e| +- s of one row, with its range over the box. */
typedef struct {
    double c, s, lo, hi;
    const double *slope_lo, *slope_hi;
    double *b, *w, *H;
} RowModel;

/* Reads the model from the form of the row's gradient. */
static void read_row(const Box *x, int r, RowModel *to)
{
    int n = x->n;
    const double *A = x->gA + (size_t)r * n * n;
    double linear = 0.0, curved = 0.0;
    for (int i = 0; i < n; i++) {
        int at = r * n + i;
        to->b[i] = x->gb[at] + (x->gp[at] + x->gq[at]) / 6, to->w[i] = (x->gq[at] - x->gp[at]) / 6 + x->gs[at];
        linear += fabs(to->b[i]) + to->w[i];
        for (int j = 0; j < n; j++) {
            to->H[i * n + j] = 0.5 * (A[i * n + j] + A[j * n + i]);
            curved += fabs(to->H[i * n + j]);
        }
    }
    to->c = x->c[r], to->s = x->s[r], to->slope_lo = x->slope_lo + r * n, to->slope_hi = x->slope_hi + r * n;
    double reach = linear + 0.5 * curved + to->s;
    reach = reach + SUM * (fabs(to->c) + reach);
    to->lo = x->lo[r] > to->c - reach || isnan(to->c - reach) ? x->lo[r] : to->c - reach;
    to->hi = x->hi[r] < to->c + reach || isnan(to->c + reach) ? x->hi[r] : to->c + reach;
}

/* Ends of 2 grad N - r grad D along variable i, times its radius, over r in an interval. */
static void gradient_factor(const RowModel *N, const RowModel *D, int n, int i, double r_lo, double r_hi, double *low, double *high)
{
    *low = INFINITY, *high = -INFINITY;
    for (int end = 0; end < 2; end++) {
        double r = end ? r_hi : r_lo, size = fabs(r), across = 0.0;
        /* A gradient's second-order terms lie in [p, q]; w is at least (q - p) / 6, and b includes (p + q) / 6. */
        double b = 2 * N->b[i] - r * D->b[i], w = 5 * (2 * N->w[i] + size * D->w[i]);
        double terms = 2 * fabs(N->b[i]) + size * fabs(D->b[i]) + w;
        for (int j = 0; j < n; j++) {
            double one = 2 * N->H[i * n + j], other = r * D->H[i * n + j];
            across += fabs(one - other), terms += fabs(one) + fabs(other);
        }
        double reach = across + w + SUM * terms, first = r * D->slope_lo[i], second = r * D->slope_hi[i];
        double most = larger(first, second), least = smaller(first, second);
        double margin = SUM * larger(fabs(first), fabs(second));
        double from = 2 * N->slope_lo[i] - most - margin, to = 2 * N->slope_hi[i] - least + margin;
        from = from > b - reach || isnan(b - reach) ? from : b - reach;
        to = to < b + reach || isnan(b + reach) ? to : b + reach;
        *low = from < *low || isnan(from) ? from : *low, *high = to > *high || isnan(to) ? to : *high;
    }
    *low -= SUM * fabs(*low), *high += SUM * fabs(*high);
}

static void product(double r_lo, double r_hi, double g_lo, double g_hi, int sign, double *low, double *high)
{
    double p = r_lo * g_lo, q = r_lo * g_hi, r = r_hi * g_lo, s = r_hi * g_hi;
    double least = smaller(smaller(p, q), smaller(r, s)), most = larger(larger(p, q), larger(r, s));
    if (isnan(p + q + r + s))
        least = -INFINITY, most = INFINITY;
    least -= SUM * fabs(least) + TINY, most += SUM * fabs(most) + TINY;
    *low = sign > 0 ? least : -most, *high = sign > 0 ? most : -least;
}

/* Range of the r for which sign r^2 D can be at least a value. */
static void where_it_matters(double *r_lo, double *r_hi, const RowModel *D, int sign, double least)
{
    if (sign < 0) {
        double edge = sqrt(larger(-least, 0.0) / D->lo) * (1 + SUM);
        edge = isnan(edge) ? INFINITY : edge;
        *r_lo = larger(*r_lo, -edge), *r_hi = smaller(*r_hi, edge);
        return;
    }
    double edge = sqrt(larger(least, 0.0) / D->hi) * (1 - SUM);
    edge = isnan(edge) ? 0.0 : edge;
    int up = *r_hi >= edge, down = -*r_lo >= edge;
    double low = up && !down ? larger(*r_lo, edge) : *r_lo, high = down && !up ? smaller(*r_hi, -edge) : *r_hi;
    *r_lo = low, *r_hi = high;
}

/* N and D, r = N / D over the box, and intermediate results for models of the quotient:
 * _Ratio in tests/reference/numpy_engine/squared_quotients.py. */
typedef struct {
    RowModel N, D;
    double rho, reach, rest, error, lo, hi;
    int is_defined;
} Ratio;

static void take_ratio(Box *x, Ratio *to)
{
    const RowModel *N = &to->N, *D = &to->D;
    int n = x->n;
    double rho = N->c / D->c, size = fabs(rho), terms = fabs(N->c) + size * fabs(D->c), curved = 0.0, w = 0.0, reach = 0.0;
    for (int i = 0; i < n; i++) {
        double *a = x->aE + i, both = N->w[i] + size * D->w[i];
        *a = N->b[i] - rho * D->b[i], reach += fabs(*a), w += both;
        terms += fabs(N->b[i]) + size * fabs(D->b[i]) + both;
        for (int l = 0; l < n; l++) {
            double one = N->H[i * n + l], other = rho * D->H[i * n + l];
            curved += fabs(one - other), terms += fabs(one) + fabs(other);
        }
    }
    double offset = N->s + size * D->s + (SUM * terms + TINY * (1 + fabs(D->c)));
    double rest = (0.5 * curved + w + offset) * (1 + SUM);
    reach *= 1 + SUM;
    to->rho = rho, to->reach = reach, to->rest = rest;
    to->error = 2 * size * offset + 3 * SUM * size * terms + TINY;
    double far = (reach + rest) / D->lo, ends[] = {N->lo / D->lo, N->lo / D->hi, N->hi / D->lo, N->hi / D->hi};
    double lo = smaller(smaller(ends[0], ends[1]), smaller(ends[2], ends[3]));
    double hi = larger(larger(ends[0], ends[1]), larger(ends[2], ends[3]));
    lo = larger(lo, rho - far), hi = smaller(hi, rho + far);
    to->lo = lo - (SUM * (fabs(lo) + size) + TINY), to->hi = hi + (SUM * (fabs(hi) + size) + TINY);
    to->is_defined = D->lo > LEAST && N->s < INFINITY && D->s < INFINITY && isfinite(reach) && isfinite(rest);
    to->is_defined = to->is_defined && (rho == 0 || (size > 1 / LARGEST && size < LARGEST));
}

/* Adds the model of a quotient to row j. */
static void add_square(Box *x, const Ratio *ratio, int j, int sign)
{
    const RowModel *N = &ratio->N, *D = &ratio->D;
    int n = x->n, known = ratio->rest < ratio->reach, is_defined = ratio->is_defined;
    double rho = ratio->rho, size = fabs(rho), reach = ratio->reach, rest = ratio->rest;
    double part = reach > 0 ? rest / reach : 0.0, added = 0.0, whole = 0.0;
    double kept = sign > 0 ? 2 * (1 + part) / D->lo : known ? 2 * (1 - part) / D->hi : 0.0;
    double more = sign > 0 ? rest * (reach + rest) / D->lo : known ? rest * (reach - rest) / D->hi : 0.0;
    for (int i = 0; i < n; i++) {
        double across = 0.0, b = 2 * rho * N->b[i] - rho * rho * D->b[i];
        double w = 2 * size * N->w[i] + rho * rho * D->w[i];
        for (int l = 0; l < n; l++) {
            double square = x->aE[i] * x->aE[l] * kept;
            double H = 2 * rho * N->H[i * n + l] - rho * rho * D->H[i * n + l], entry = sign * (H + square);
            x->gA[(j * n + i) * n + l] += entry;
            across += fabs(H), added += fabs(square), whole += fabs(entry);
        }
        w += SUM * (fabs(b) + across + w);
        x->gs[j * n + i] += is_defined ? w : INFINITY;
        x->gb[j * n + i] += sign * b;
        whole += 2 * w;
    }
    double error = ratio->error + SUM * (more + added), high = sign * (rho * (2 * N->c - rho * D->c)) + more + error;
    double numerator = sign > 0 ? larger(fabs(N->c) - N->s, 0.0) : fabs(N->c) + N->s;
    double low = sign * (numerator * numerator) / (sign > 0 ? D->c + D->s : D->c - D->s);
    low -= SUM * fabs(low) + TINY;
    double half = 0.5 * (high - low) + SUM * (fabs(high) + fabs(low));
    double r_lo = ratio->lo * ratio->lo, r_hi = ratio->hi * ratio->hi;
    double most = larger(r_lo, r_hi) * D->hi, other = larger(N->lo * N->lo, N->hi * N->hi) / D->lo;
    double lost = TINY * (1 + D->hi);
    double fewest = ratio->lo > 0 || ratio->hi < 0 ? smaller(r_lo, r_hi) * D->lo * (1 - SUM) - lost : 0.0;
    most = (other < most || isnan(most) ? other : most) * (1 + SUM) + lost;
    x->c[j] += 0.5 * (high + low), x->s[j] += is_defined && !isnan(half) ? half : INFINITY;
    x->lo[j] += sign > 0 ? fewest : -most, x->hi[j] += sign > 0 ? most : -fewest;
    x->q[j] += 0.5 * whole * (1 + SUM);
}

/* Adds the ends of a quotient's gradient to row j; ends without the factor radius are for relevant points only. */
static void add_slopes(Box *x, const Ratio *ratio, int j, int sign, const double *least)
{
    int n = x->n;
    const double *radius = x->radius;
    double p_lo = ratio->lo, p_hi = ratio->hi;
    if (least)
        where_it_matters(&p_lo, &p_hi, &ratio->D, sign, *least);
    for (int i = 0; i < n; i++) {
        int at = j * n + i;
        double g_lo, g_hi, low, high;
        gradient_factor(&ratio->N, &ratio->D, n, i, ratio->lo, ratio->hi, &g_lo, &g_hi);
        product(ratio->lo, ratio->hi, g_lo, g_hi, sign, &low, &high);
        x->slope_lo[at] += low, x->slope_hi[at] += high;
        if (least) {
            gradient_factor(&ratio->N, &ratio->D, n, i, p_lo, p_hi, &g_lo, &g_hi);
            product(p_lo, p_hi, g_lo, g_hi, sign, &low, &high);
        }
        low = radius[i] > 0 ? low / radius[i] : -INFINITY, high = radius[i] > 0 ? high / radius[i] : INFINITY;
        x->grad_lo[at] += low - SUM * fabs(low), x->grad_hi[at] += high + SUM * fabs(high);
    }
}

/* Adds the quotients to the rows of their functions. */
static void add_quotients(const Form *form, Box *x, const double *least)
{
    Ratio ratio = {.N = {.b = x->bN, .w = x->wN, .H = x->HN}, .D = {.b = x->bD, .w = x->wD, .H = x->HD}};
    for (int k = 0; k < form->quotients; k++) {
        int j = form->whose[2 * k], sign = form->whose[2 * k + 1], row = form->expressions + 2 * k;
        read_row(x, row, &ratio.N), read_row(x, row + 1, &ratio.D);
        take_ratio(x, &ratio);
        add_square(x, &ratio, j, sign);
        add_slopes(x, &ratio, j, sign, form->quotients == 1 ? least : NULL);
    }
}

#endif
