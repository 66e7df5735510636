/* The interpreter of a tape in forms of second order over LANES boxes; second_order.py. */
#ifndef SECONDORDER_H
#define SECONDORDER_H

#include "enclosure.h"

/* Most variables of a form: bits of an unsigned number. */
#define MOST_VARIABLES 15

/* Which coefficients of a form may differ from 0, as bits: a, and the rows of Q, which is symmetric. */
typedef struct {
    unsigned linear, pairs[MOST_VARIABLES];
} Terms;

/* c + a e + Q(e) + [p, q] +- s, with Q's range [sl, sh]. The n coefficients a follow in memory, then those of e_i e_j,
 * i <= j, row by row. Memory is all 0 at first, and coefficients that are no terms stay so. */
typedef struct {
    Value v;
    Lane sl, sh;
    Terms terms;
} Form2;

/* The variables i = from, ..., n - 1 of a set of bits. */
#define EACH_OF(i, from, set) for (int i = from; i < n; i++) if ((set) >> i & 1)

static size_t pairs_of(int n) { return (size_t)n * ((size_t)n + 1) / 2; }
static size_t stride_of_form2(int n) { return sizeof(Form2) / sizeof(double) + ((size_t)n + pairs_of(n)) * LANES; }
static inline Form2 *form2_of(Store s, int i) { return (Form2 *)(s.memory + (size_t)i * s.stride); }
static inline Lane *terms_of_form2(Form2 *v) { return (Lane *)(v + 1); }

/* Place of the coefficient of e_i e_j, i <= j, less j. */
static inline int row_of(int n, int i) { return i * n - i * (i + 1) / 2; }

/* The terms of a sum, with product those of a product, and with dense those of any function, of two forms. */
static Terms structure_of(int n, Terms x, Terms y, int product, int dense)
{
    Terms found = {.linear = x.linear | y.linear};
    for (int i = 0; i < n; i++) {
        found.pairs[i] = x.pairs[i] | y.pairs[i];
        if (product)
            found.pairs[i] |= (x.linear >> i & 1 ? y.linear : 0) | (y.linear >> i & 1 ? x.linear : 0);
        if (dense)
            found.pairs[i] |= found.linear >> i & 1 ? found.linear : 0;
    }
    return found;
}

/* The variables k for which e_i e_j e_k may be a term of the product of a linear and a quadratic part. */
INLINE unsigned cubic_terms(Terms a, Terms Q, int i, int j)
{
    return (a.linear >> i & 1 ? Q.pairs[j] : 0) | (a.linear >> j & 1 ? Q.pairs[i] : 0) | (Q.pairs[i] >> j & 1 ? a.linear : 0);
}

/* Sums of the sizes of the coefficients of a (other's Q) + (other's a) Q, monomial by monomial; with one = other, of
 * 2 a Q. */
INLINE void cubic_sizes(int n, Terms x, Terms y, const Lane *a, const Lane *Q, const Lane *b, const Lane *P, int own,
                        double *restrict out)
{
    EACH out[l] = 0.0;
    EACH_OF(i, 0, x.linear | y.linear)
    {
        const Lane *Qi = Q + row_of(n, i), *Pi = P + row_of(n, i);
        if ((cubic_terms(x, y, i, i) | cubic_terms(y, x, i, i)) >> i & 1) {
            if (own)
                EACH out[l] += fabs(2 * (a[i][l] * Q[row_of(n, i) + i][l]));
            else
                EACH out[l] += fabs(a[i][l] * Pi[i][l] + b[i][l] * Qi[i][l]);
        }
        EACH_OF(j, i + 1, x.linear | y.linear)
        {
            const Lane *Qj = Q + row_of(n, j), *Pj = P + row_of(n, j);
            unsigned third = cubic_terms(x, y, i, j) | cubic_terms(y, x, i, j);
            if (third >> i & 1 || third >> j & 1) {
                if (own)
                    EACH out[l] += fabs(2 * (a[i][l] * Qi[j][l] + a[j][l] * Qi[i][l])) +
                                   fabs(2 * (a[i][l] * Qj[j][l] + a[j][l] * Qi[j][l]));
                else
                    EACH out[l] += fabs((a[i][l] * Pi[j][l] + a[j][l] * Pi[i][l]) + (b[i][l] * Qi[j][l] + b[j][l] * Qi[i][l])) +
                                   fabs((a[i][l] * Pj[j][l] + a[j][l] * Pi[j][l]) + (b[i][l] * Qj[j][l] + b[j][l] * Qi[j][l]));
            }
            EACH_OF(k, j + 1, third)
            {
                if (own)
                    EACH out[l] += fabs(2 * (a[i][l] * Qj[k][l] + a[j][l] * Qi[k][l] + a[k][l] * Qi[j][l]));
                else
                    EACH out[l] += fabs((a[i][l] * Pj[k][l] + a[j][l] * Pi[k][l] + a[k][l] * Pi[j][l]) +
                                        (b[i][l] * Qj[k][l] + b[j][l] * Qi[k][l] + b[k][l] * Qi[j][l]));
            }
        }
    }
}

/* Makes the coefficients of a form those of t, which has these terms. */
INLINE void write_terms(Form2 *v, int n, Terms terms, const Lane *t)
{
    Lane *to = terms_of_form2(v);
    EACH_OF(i, 0, terms.linear | v->terms.linear)
    {
        int at = n + row_of(n, i);
        if (terms.linear >> i & 1)
            memcpy(to + i, t + i, sizeof(Lane));
        else
            memset(to + i, 0, sizeof(Lane));
        EACH_OF(j, i, terms.pairs[i] | v->terms.pairs[i])
        {
            if (terms.pairs[i] >> j & 1)
                memcpy(to + at + j, t + at + j, sizeof(Lane));
            else
                memset(to + at + j, 0, sizeof(Lane));
        }
    }
    v->terms = terms;
}

/* Writes a value and its coefficients, with the ranges of its parts. */
INLINE void settle2(Form2 *restrict to, int n, Terms which, double slack, const Result *restrict from, Lane *restrict t)
{
    Lane *terms = terms_of_form2(to), rad, low, high;
    EACH rad[l] = low[l] = high[l] = 0.0;
    EACH_OF(i, 0, which.linear)
    {
        const Lane *row = t + n + row_of(n, i);
        EACH rad[l] += fabs(t[i][l]);
        if (which.pairs[i] >> i & 1)
            EACH
            {
                double own = row[i][l];
                low[l] += smaller(own, 0.0), high[l] += larger(own, 0.0);
            }
        EACH_OF(j, i + 1, which.pairs[i])
            EACH
            {
                double size = fabs(row[j][l]);
                low[l] -= size, high[l] += size;
            }
    }
    int all = settle_value(&to->v, slack, from, rad, low, high);
    write_terms(to, n, which, t);
    EACH
    {
        int good = to->v.s[l] < INFINITY;
        to->sl[l] = good ? low[l] : 0.0, to->sh[l] = good ? high[l] : 0.0;
    }
    if (!all)
        for (size_t i = 0; i < (size_t)n + pairs_of(n); i++)
            EACH terms[i][l] = to->v.s[l] < INFINITY ? terms[i][l] : 0.0;
}

/* Half of a function's second derivative at c, from its rule. */
static double curve_of(int op, Rule rule, double c)
{
    switch (op) {
    case SQRT:
        return -0.25 * rule.slope / c;
    case SIN:
    case COS:
        return -0.5 * rule.value;
    case EXP:
        return 0.5 * rule.value;
    case LOG:
        return -0.5 * rule.slope * rule.slope;
    case ATAN:
        return -c * rule.slope * rule.slope;
    default:
        return 0.0;
    }
}

/* Writes the linear coefficients t[i] and those of pairs t[at] that are terms. */
#define EACH_TERM(first, pair)                                                                                        \
    EACH_OF(i, 0, which.linear)                                                                                        \
    {                                                                                                                  \
        EACH t[i][l] = first;                                                                                          \
        EACH_OF(j, i, which.pairs[i])                                                                                  \
        {                                                                                                              \
            int at = n + row_of(n, i) + j;                                                                             \
            EACH t[at][l] = pair;                                                                                      \
        }                                                                                                              \
    }

WIDE static void run2(const Tape *tape, int n, Store work, Store out, Lane *centre, Lane *radius, Lane *lower,
                      Lane *upper, Lane *restrict t)
{
    const Terms none = {0};
    /* An operation makes fewer roundings of each of its terms than there are monomials of third order. */
    double slack = ((double)(n * (n + 1) * (n + 2) / 6) + 16) * ULP;
    for (int index = 0; index < tape->length; index++) {
        const int *code = tape->code + 6 * index;
        int op = code[0];
        double k = tape->k[index];
        Form2 *to = form2_of(op == OUTPUT ? out : work, code[1]);
        Value *v = &to->v;
        if (op == OUTPUT) {
            const Form2 *from = form2_of(work, code[2]);
            memcpy(to, from, offsetof(Form2, terms));
            write_terms(to, n, from->terms, terms_of_form2((Form2 *)from));
            continue;
        }
        if (op == INPUT || op == CONSTANT) {
            write_terms(to, n, none, t);
            memset(to, 0, offsetof(Form2, terms));
        }
        if (op == INPUT) {
            to->terms.linear = 1u << code[2];
            memcpy(v->c, centre[code[2]], sizeof(Lane));
            memcpy(v->lo, lower[code[2]], sizeof(Lane));
            memcpy(v->hi, upper[code[2]], sizeof(Lane));
            memcpy(v->rad, radius[code[2]], sizeof(Lane));
            memcpy(terms_of_form2(to)[code[2]], radius[code[2]], sizeof(Lane));
            continue;
        }
        if (op == CONSTANT) {
            EACH v->c[l] = v->lo[l] = v->hi[l] = k;
            continue;
        }
        const Form2 *one = form2_of(work, code[2]), *other = form2_of(work, code[3]);
        const Value *x = &one->v, *y = &other->v;
        const double *xl = one->sl, *xh = one->sh, *yl = other->sl, *yh = other->sh;
        const Lane *ax = (const Lane *)(one + 1), *ay = (const Lane *)(other + 1), *Qx = ax + n, *Qy = ay + n;
        int is_binary = op == ADD || op == SUB || op == MUL || op == DIV, is_sum = op == ADD || op == SUB || op == SHIFT || op == SCALE;
        Terms X = one->terms, Y = is_binary ? other->terms : op == SQUARE ? X : none;
        const Terms which = structure_of(n, X, Y, op == MUL || op == SQUARE, !is_sum && op != MUL && op != SQUARE);
        Lane cubic, sizes;
        Result r;
        switch (op) {
        case ADD:
            EACH_TERM(ax[i][l] + ay[i][l], ax[at][l] + ay[at][l])
            EACH sizes[l] = fabs(x->c[l] + y->c[l]) + ((x->rad[l] + y->rad[l]) + ((xh[l] - xl[l]) + (yh[l] - yl[l])));
            add(x, y, 1.0, sizes, slack, &r);
            break;
        case SUB:
            EACH_TERM(ax[i][l] - ay[i][l], ax[at][l] - ay[at][l])
            EACH sizes[l] = fabs(x->c[l] - y->c[l]) + ((x->rad[l] + y->rad[l]) + ((xh[l] - xl[l]) + (yh[l] - yl[l])));
            add(x, y, -1.0, sizes, slack, &r);
            break;
        case SHIFT:
            EACH_TERM(ax[i][l], ax[at][l])
            shift(x, k, slack, &r);
            break;
        case SCALE:
            EACH_TERM(ax[i][l] * k, ax[at][l] * k)
            EACH sizes[l] = x->rad[l] + (xh[l] - xl[l]);
            scale(x, k, sizes, slack, &r);
            break;
        case MUL:
            EACH_OF(i, 0, which.linear)
            {
                EACH t[i][l] = x->c[l] * ay[i][l] + y->c[l] * ax[i][l];
                int at = n + row_of(n, i);
                if (which.pairs[i] >> i & 1)
                    EACH t[at + i][l] = (x->c[l] * ay[at + i][l] + y->c[l] * ax[at + i][l]) + ax[i][l] * ay[i][l];
                EACH_OF(j, i + 1, which.pairs[i])
                    EACH t[at + j][l] = (x->c[l] * ay[at + j][l] + y->c[l] * ax[at + j][l]) + (ax[i][l] * ay[j][l] + ax[j][l] * ay[i][l]);
            }
            cubic_sizes(n, X, Y, ax, Qx, ay, Qy, 0, cubic);
            EACH
            {
                double cx = x->c[l], cy = y->c[l], rx = x->rad[l], ry = y->rad[l], px = x->p[l], qx = x->q[l];
                double py = y->p[l], qy = y->q[l], mx = larger(-px, qx), my = larger(-py, qy);
                double Sx = larger(-xl[l], xh[l]), Sy = larger(-yl[l], yh[l]);
                double higher = cubic[l] + Sx * Sy + ((rx + Sx) * my + (ry + Sy) * mx + mx * my);
                double big = fabs(cx) + rx + (xh[l] - xl[l]) + mx, other = fabs(cy) + ry + (yh[l] - yl[l]) + my;
                r.c[l] = cx * cy;
                r.p[l] = smaller(cx * py, cx * qy) + smaller(cy * px, cy * qx) - higher;
                r.q[l] = larger(cx * py, cx * qy) + larger(cy * px, cy * qx) + higher;
                r.s[l] = (big * y->s[l] + other * x->s[l] + x->s[l] * y->s[l]) + (slack * (big * other) + TINY);
            }
            interval_product(x->lo, x->hi, y->lo, y->hi, &r);
            break;
        case SQUARE:
            EACH_OF(i, 0, which.linear)
            {
                EACH t[i][l] = 2 * x->c[l] * ax[i][l];
                int at = n + row_of(n, i);
                EACH t[at + i][l] = 2 * x->c[l] * ax[at + i][l] + ax[i][l] * ax[i][l];
                EACH_OF(j, i + 1, which.pairs[i])
                    EACH t[at + j][l] = 2 * x->c[l] * ax[at + j][l] + 2 * (ax[i][l] * ax[j][l]);
            }
            cubic_sizes(n, X, X, ax, Qx, ax, Qx, 1, cubic);
            EACH
            {
                double c = x->c[l], rad = x->rad[l], p = x->p[l], q = x->q[l], s = x->s[l], m = larger(-p, q);
                double S = larger(-xl[l], xh[l]), mixed = cubic[l] + 2 * rad * m;
                double size = fabs(c) + rad + (xh[l] - xl[l]) + m;
                r.c[l] = c * c;
                r.p[l] = smaller(2 * c * p, 2 * c * q) - mixed;
                r.q[l] = larger(2 * c * p, 2 * c * q) + (mixed + (S + m) * (S + m));
                r.s[l] = 2 * size * s + s * s + (slack * (size * size) + TINY);
            }
            square_ends(x, &r);
            break;
        case DIV: {
            Lane ratio, inverse, near, rad, size, low, high;
            inverse_ends(y, near, low, high);
            EACH inverse[l] = 1.0 / y->c[l], ratio[l] = x->c[l] / y->c[l], rad[l] = size[l] = 0.0;
            EACH_OF(i, 0, which.linear)
                EACH
                {
                    t[i][l] = (ax[i][l] - ratio[l] * ay[i][l]) * inverse[l];
                    rad[l] += fabs(t[i][l]);
                }
            EACH_OF(i, 0, which.linear)
                EACH_OF(j, i, which.pairs[i])
                {
                    int at = n + row_of(n, i) + j;
                    EACH
                    {
                        double crossed = t[i][l] * ay[j][l] + (i == j ? 0.0 : t[j][l] * ay[i][l]);
                        t[at][l] = ((ax[at][l] - ratio[l] * ay[at][l]) - crossed) * inverse[l];
                        size[l] += fabs(t[at][l]);
                    }
                }
            cubic_sizes(n, which, Y, t, t + n, ay, Qy, 0, cubic);
            EACH
            {
                int positive = y->lo[l] > 0;
                double by = ratio[l], py = y->p[l], qy = y->q[l], my = larger(-py, qy), moved = rad[l] + size[l];
                double Sy = larger(-yl[l], yh[l]), higher = cubic[l] + size[l] * Sy + moved * my;
                double p = x->p[l] - larger(by * py, by * qy) - higher, q = x->q[l] - smaller(by * py, by * qy) + higher;
                double whole = fabs(by) + moved, ylong = fabs(y->c[l]) + y->rad[l] + (yh[l] - yl[l]) + my;
                double xlong = fabs(x->c[l]) + x->rad[l] + (xh[l] - xl[l]);
                double s = x->s[l] + whole * y->s[l] + (slack * (xlong + whole * ylong) + TINY * (1 + ylong));
                r.c[l] = by, r.s[l] = s / near[l] + (slack * whole + TINY);
                r.p[l] = (positive ? p : -q) / near[l], r.q[l] = (positive ? q : -p) / near[l];
            }
            interval_product(x->lo, x->hi, low, high, &r);
            break;
        }
        default: {
            Lane slopes, curves;
            cubic_sizes(n, X, X, ax, Qx, ax, Qx, 1, cubic);
            EACH
            {
                Rule rule = rule_of(op, x->c[l], x->lo[l], x->hi[l]);
                double slope = rule.slope, curve = curve_of(op, rule, x->c[l]), p = x->p[l], q = x->q[l], s = x->s[l];
                double m = larger(-p, q), S = larger(-xl[l], xh[l]), rad = x->rad[l];
                double moved = rad + (xh[l] - xl[l]) + m, reach = moved + s;
                double mixed = cubic[l] + 2 * rad * m, square = mixed + (S + m) * (S + m);
                double rest = reach * reach * (reach / 6), least = -rest, most = rest;
                if (op != SIN && op != COS) {
                    double blur = (fabs(rule.least) + fabs(rule.most) + fabs(curve)) * ULP;
                    least = (rule.least - curve - blur) * (reach * reach), most = (rule.most - curve + blur) * (reach * reach);
                }
                slopes[l] = slope, curves[l] = curve;
                r.c[l] = rule.value, r.lo[l] = rule.lo, r.hi[l] = rule.hi;
                r.p[l] = smaller(slope * p, slope * q) + smaller(curve * -mixed, curve * square) + smaller(least, 0.0);
                r.q[l] = larger(slope * p, slope * q) + larger(curve * -mixed, curve * square) + larger(most, 0.0);
                double steep = fabs(slope) + 2 * fabs(curve) * reach;
                double size = fabs(rule.value) + fabs(slope) * moved + fabs(curve) * (moved * moved);
                /* larger() and smaller() lose a NaN: one in the rule must poison the value. */
                double unknown = 0 * (least + most);
                double lost = TINY * (1 + fabs(curve) + fabs(rule.least) + fabs(rule.most));
                double further = moved + moved * moved;
                double error = rule.error + rule.slope_error * further + lost * (1 + further);
                r.s[l] = steep * s + error + slack * size + unknown;
            }
            EACH_OF(i, 0, which.linear)
            {
                int at = n + row_of(n, i);
                EACH t[at + i][l] = slopes[l] * ax[at + i][l] + curves[l] * (ax[i][l] * ax[i][l]);
                EACH_OF(j, i + 1, which.pairs[i])
                    EACH t[at + j][l] = slopes[l] * ax[at + j][l] + 2 * curves[l] * (ax[i][l] * ax[j][l]);
                EACH t[i][l] = slopes[l] * ax[i][l];
            }
        }
        }
        settle2(to, n, which, slack, &r, t);
    }
}

#endif
