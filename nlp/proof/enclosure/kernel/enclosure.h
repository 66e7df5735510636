/* The interpreter of a tape over LANES boxes; first_order.py. */
#ifndef ENCLOSURE_H
#define ENCLOSURE_H

#include "univariate.h"

typedef struct {
    Lane c, p, q, s, lo, hi;
} Result;

/* A form without its rounding error: centre, sum of |a|, least and largest terms of second order. */
typedef struct {
    const double *c, *rad, *p, *q;
} Part;

INLINE void interval_product(const double *lo, const double *hi, const double *other_lo, const double *other_hi,
                             Result *restrict out)
{
    EACH
    {
        double p = lo[l] * other_lo[l], q = lo[l] * other_hi[l], r = hi[l] * other_lo[l], s = hi[l] * other_hi[l];
        double least = smaller(smaller(p, q), smaller(r, s)), most = larger(larger(p, q), larger(r, s));
        least = least - (fabs(least) * ULP + TINY);
        double nonnegative = least > 0.0 ? least : 0.0;
        out->lo[l] = (lo[l] >= 0) & (other_lo[l] >= 0) ? nonnegative : least;
        out->hi[l] = most + (fabs(most) * ULP + TINY);
    }
}

/* Terms of second order of a product; the sums are those of a a', |a a'|, |a r' + a' r| and |a r' - a' r|. */
INLINE void second_order(Part x, Part y, const double *balance, const double *sizes, const double *plus,
                         const double *minus, Result *restrict out, double *restrict big, double *restrict other)
{
    EACH
    {
        double cx = x.c[l], cy = y.c[l], rx = x.rad[l], ry = y.rad[l], px = x.p[l], qx = x.q[l], py = y.p[l], qy = y.q[l];
        double both = rx * ry, cross = both - sizes[l];
        double most = 0.5 * (sizes[l] + balance[l]) + cross, least = 0.5 * (sizes[l] - balance[l]) + cross;
        double quarter = 0.25 / (both > 0 ? both : 1.0);
        /* In this order: the square of a sum may underflow. */
        double more = plus[l] * (plus[l] * quarter), less = minus[l] * (minus[l] * quarter);
        most = more < most ? more : most, least = less < least ? less : least;
        double mx = larger(-px, qx), my = larger(-py, qy), mixed = rx * my + ry * mx + mx * my;
        out->p[l] = smaller(cx * py, cx * qy) + smaller(cy * px, cy * qx) - (least + mixed);
        out->q[l] = larger(cx * py, cx * qy) + larger(cy * px, cy * qx) + (most + mixed);
        big[l] = fabs(cx) + rx + mx, other[l] = fabs(cy) + ry + my;
    }
}

/* Ends of the square of an interval. */
INLINE void square_ends(const Value *x, Result *restrict out)
{
    EACH
    {
        double one = fabs(x->lo[l]), two = fabs(x->hi[l]);
        double small = one < two ? one : two, large = one < two ? two : one;
        small = (x->lo[l] <= 0) & (x->hi[l] >= 0) ? 0.0 : small;
        double lo = small * small, hi = large * large;
        lo = lo - (lo * ULP + TINY);
        out->lo[l] = lo > 0.0 ? lo : 0.0, out->hi[l] = hi + (hi * ULP + TINY);
    }
}

/* Ends of the inverse of an interval without 0, and the size of its end that is nearest to 0; NaN for another one. */
INLINE void inverse_ends(const Value *y, double *restrict near, double *restrict low, double *restrict high)
{
    EACH
    {
        int positive = y->lo[l] > 0;
        double close = positive ? y->lo[l] : -y->hi[l], far = positive ? y->hi[l] : -y->lo[l];
        near[l] = close = close > 0 ? close : NAN;
        double one = (positive ? 1.0 : -1.0) / far, two = (positive ? 1.0 : -1.0) / close;
        double least = one < two ? one : two, most = one < two ? two : one;
        low[l] = least - (fabs(least) * ULP + TINY), high[l] = most + (fabs(most) * ULP + TINY);
    }
}

/* A sum, or a difference where sign is -1, apart from its coefficients; sizes are those of all terms. */
INLINE void add(const Value *x, const Value *y, double sign, const double *sizes, double slack, Result *restrict r)
{
    const double *p = sign > 0 ? y->p : y->q, *q = sign > 0 ? y->q : y->p;
    const double *low = sign > 0 ? y->lo : y->hi, *high = sign > 0 ? y->hi : y->lo;
    EACH
    {
        double c = x->c[l] + sign * y->c[l], lo = x->lo[l] + sign * low[l], hi = x->hi[l] + sign * high[l];
        r->c[l] = c, r->p[l] = x->p[l] + sign * p[l], r->q[l] = x->q[l] + sign * q[l];
        r->s[l] = x->s[l] + y->s[l] + slack * sizes[l];
        r->lo[l] = lo - fabs(lo) * ULP, r->hi[l] = hi + fabs(hi) * ULP;
    }
}

/* A value plus k, apart from its coefficients. */
INLINE void shift(const Value *x, double k, double slack, Result *restrict r)
{
    EACH
    {
        double c = x->c[l] + k, lo = x->lo[l] + k, hi = x->hi[l] + k;
        r->c[l] = c, r->p[l] = x->p[l], r->q[l] = x->q[l], r->s[l] = x->s[l] + slack * fabs(c);
        r->lo[l] = lo - fabs(lo) * ULP, r->hi[l] = hi + fabs(hi) * ULP;
    }
}

/* A value times k, apart from its coefficients; 1 and -1 cause no rounding. */
INLINE void scale(const Value *x, double k, const double *sizes, double slack, Result *restrict r)
{
    double size = fabs(k);
    EACH
    {
        double c = x->c[l] * k, down = x->lo[l] * k, up = x->hi[l] * k, p = x->p[l] * k, q = x->q[l] * k;
        double lo = k >= 0 ? down : up, hi = k >= 0 ? up : down;
        r->c[l] = c, r->p[l] = k >= 0 ? p : q, r->q[l] = k >= 0 ? q : p;
        r->s[l] = size == 1 ? x->s[l] : x->s[l] * size + (slack * (fabs(c) + size * sizes[l]) + TINY);
        r->lo[l] = size == 1 ? lo : lo - (fabs(lo) * ULP + TINY);
        r->hi[l] = size == 1 ? hi : hi + (fabs(hi) * ULP + TINY);
    }
}

/* Writes a value apart from its coefficients, from the sum of the sizes of the linear ones and the range of the others:
 * poisons one without a finite form, intersects the interval with the form's range. Whether no lane is poisoned. */
INLINE int settle_value(Value *restrict v, double slack, const Result *restrict from, const double *rad,
                        const double *curved_lo, const double *curved_hi)
{
    double grown = 1 + slack;
    int all = 1;
    EACH
    {
        double c = from->c[l], p = smaller(from->p[l] * grown, 0.0), q = larger(from->q[l] * grown, 0.0);
        double s = from->s[l] * grown, ends = ULP * fabs(c) + s;
        double down = (rad[l] - curved_lo[l] - p + ends) * grown, up = (rad[l] + curved_hi[l] + q + ends) * grown;
        int good = (down < LARGEST) & (up < LARGEST) & (fabs(c) < LARGEST);
        double low = c - down, high = c + up;
        low = low - ULP * fabs(low), high = high + ULP * fabs(high);
        double lo = from->lo[l] > low ? from->lo[l] : low, hi = from->hi[l] < high ? from->hi[l] : high;
        all &= good;
        v->c[l] = good ? c : 0.0, v->rad[l] = good ? rad[l] : 0.0;
        v->p[l] = good ? p : 0.0, v->q[l] = good ? q : 0.0, v->s[l] = good ? s : INFINITY;
        v->lo[l] = good ? lo : -INFINITY, v->hi[l] = good ? hi : INFINITY;
    }
    return all;
}

/* Writes a value and its coefficients. */
INLINE void settle(Value *restrict v, int n, int first, int last, double slack, const Result *restrict from,
                   Lane *restrict t)
{
    static const Lane none = {0};
    Lane *a = terms_of(v), rad;
    EACH rad[l] = 0.0;
    for (int i = first; i < last; i++)
        EACH rad[l] += fabs(t[i][l]);
    int all = settle_value(v, slack, from, rad, none, none);
    memset(a, 0, (size_t)first * sizeof(Lane));
    memcpy(a + first, t + first, (size_t)(last - first) * sizeof(Lane));
    memset(a + last, 0, (size_t)(n - last) * sizeof(Lane));
    if (!all)
        for (int i = first; i < last; i++)
            EACH a[i][l] = v->s[l] < INFINITY ? a[i][l] : 0.0;
}

WIDE static void run(const Tape *tape, int n, Store work, Store out, Lane *centre, Lane *radius, Lane *lower,
                     Lane *upper, Lane *restrict t)
{
    double slack = (n + 8) * ULP;
    size_t whole = sizeof(Value) + (size_t)n * sizeof(Lane);
    for (int index = 0; index < tape->length; index++) {
        const int *code = tape->code + 6 * index;
        int op = code[0], first = code[4], last = code[5];
        double k = tape->k[index];
        Value *v = value_of(op == OUTPUT ? out : work, code[1]);
        if (op == OUTPUT) {
            memcpy(v, value_of(work, code[2]), whole);
            continue;
        }
        if (op == INPUT) {
            memset(v, 0, whole);
            memcpy(v->c, centre[code[2]], sizeof(Lane));
            memcpy(v->lo, lower[code[2]], sizeof(Lane));
            memcpy(v->hi, upper[code[2]], sizeof(Lane));
            memcpy(v->rad, radius[code[2]], sizeof(Lane));
            memcpy(terms_of(v)[code[2]], radius[code[2]], sizeof(Lane));
            continue;
        }
        if (op == CONSTANT) {
            memset(v, 0, whole);
            EACH v->c[l] = v->lo[l] = v->hi[l] = k;
            continue;
        }
        const Value *x = value_of(work, code[2]), *y = value_of(work, code[3]);
        const Lane *ax = (const Lane *)(x + 1), *ay = (const Lane *)(y + 1);
        Lane balance, sizes, plus, minus, big, other;
        Result r;
        switch (op) {
        case ADD:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l] + ay[i][l];
            EACH sizes[l] = fabs(x->c[l] + y->c[l]) + x->rad[l] + y->rad[l];
            add(x, y, 1.0, sizes, slack, &r);
            break;
        case SUB:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l] - ay[i][l];
            EACH sizes[l] = fabs(x->c[l] - y->c[l]) + x->rad[l] + y->rad[l];
            add(x, y, -1.0, sizes, slack, &r);
            break;
        case SHIFT:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l];
            shift(x, k, slack, &r);
            break;
        case SCALE:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l] * k;
            scale(x, k, x->rad, slack, &r);
            break;
        case MUL: {
            EACH balance[l] = sizes[l] = plus[l] = minus[l] = 0.0;
            for (int i = first; i < last; i++)
                EACH
                {
                    double p = ax[i][l], q = ay[i][l], product = p * q, one = p * y->rad[l], two = q * x->rad[l];
                    balance[l] += product, sizes[l] += fabs(product);
                    plus[l] += fabs(one + two), minus[l] += fabs(one - two);
                    t[i][l] = x->c[l] * q + y->c[l] * p;
                }
            Part one = {x->c, x->rad, x->p, x->q}, two = {y->c, y->rad, y->p, y->q};
            second_order(one, two, balance, sizes, plus, minus, &r, big, other);
            EACH
            {
                r.c[l] = x->c[l] * y->c[l];
                r.s[l] = (big[l] * y->s[l] + other[l] * x->s[l] + x->s[l] * y->s[l]) + (slack * (big[l] * other[l]) + TINY);
            }
            interval_product(x->lo, x->hi, y->lo, y->hi, &r);
            break;
        }
        case SQUARE:
            for (int i = first; i < last; i++)
                EACH t[i][l] = 2 * x->c[l] * ax[i][l];
            EACH
            {
                double c = x->c[l], rad = x->rad[l], p = x->p[l], q = x->q[l], s = x->s[l], m = larger(-p, q);
                double mixed = 2 * rad * m + m * m, size = fabs(c) + rad + m;
                r.c[l] = c * c;
                r.p[l] = smaller(2 * c * p, 2 * c * q) - mixed;
                r.q[l] = larger(2 * c * p, 2 * c * q) + (rad * rad + mixed);
                r.s[l] = 2 * size * s + s * s + (slack * (size * size) + TINY);
            }
            square_ends(x, &r);
            break;
        case DIV: {
            Lane zero, ratio, inverse, steep, pi, qi, ri, si, pn, qn, rn, sn, low, high, near;
            inverse_ends(y, near, low, high);
            EACH
            {
                int positive = y->lo[l] > 0;
                double c = y->c[l], my = larger(-y->p[l], y->q[l]), moved = y->rad[l] + my;
                inverse[l] = 1.0 / c, steep[l] = inverse[l] * inverse[l];
                double curved = moved * moved * steep[l] / near[l], p = -steep[l] * y->q[l], q = -steep[l] * y->p[l];
                pi[l] = positive ? p : p - curved, qi[l] = positive ? q + curved : q, ri[l] = steep[l] * y->rad[l];
                double size = fabs(inverse[l]) + ri[l] + larger(-pi[l], qi[l]);
                si[l] = y->s[l] * steep[l] * (1 + (2 * moved + y->s[l]) / near[l]) + (slack * size + TINY);
                double by = x->c[l] / c, steepness = fabs(by);
                ratio[l] = by;
                pn[l] = x->p[l] - (by >= 0 ? by * y->q[l] : by * y->p[l]);
                qn[l] = x->q[l] - (by >= 0 ? by * y->p[l] : by * y->q[l]);
                double all = fabs(x->c[l]) + x->rad[l] + steepness * (fabs(c) + y->rad[l]);
                sn[l] = x->s[l] + steepness * y->s[l] + (slack * all + TINY * (1 + fabs(c)));
                zero[l] = rn[l] = balance[l] = sizes[l] = plus[l] = minus[l] = 0.0;
            }
            for (int i = first; i < last; i++)
                EACH rn[l] += fabs(ax[i][l] - ratio[l] * ay[i][l]);
            for (int i = first; i < last; i++)
                EACH
                {
                    double p = ax[i][l] - ratio[l] * ay[i][l], q = -steep[l] * ay[i][l], product = p * q;
                    double one = p * ri[l], two = q * rn[l];
                    balance[l] += product, sizes[l] += fabs(product);
                    plus[l] += fabs(one + two), minus[l] += fabs(one - two);
                    t[i][l] = inverse[l] * p;
                }
            Part one = {zero, rn, pn, qn}, two = {inverse, ri, pi, qi};
            second_order(one, two, balance, sizes, plus, minus, &r, big, other);
            EACH
            {
                r.c[l] = ratio[l];
                r.s[l] = big[l] * si[l] + other[l] * sn[l] + sn[l] * si[l] +
                         (slack * (fabs(ratio[l]) + big[l] * other[l]) + TINY);
            }
            interval_product(x->lo, x->hi, low, high, &r);
            break;
        }
        default: {
            Lane slopes;
            EACH
            {
                Rule rule = rule_of(op, x->c[l], x->lo[l], x->hi[l]);
                double slope = rule.slope, moved = x->rad[l] + larger(-x->p[l], x->q[l]), square = moved * moved;
                double down = slope * x->p[l], up = slope * x->q[l];
                r.c[l] = rule.value, r.lo[l] = rule.lo, r.hi[l] = rule.hi, slopes[l] = slope;
                r.p[l] = smaller(down, up) + smaller(rule.least * square, 0.0);
                r.q[l] = larger(down, up) + larger(rule.most * square, 0.0);
                double bent = larger(fabs(rule.least), fabs(rule.most)), steep = fabs(slope) + 2 * bent * (moved + x->s[l]);
                double size = fabs(slope) * moved + fabs(rule.value);
                /* larger() and smaller() lose a NaN: one in the rule must poison the value. */
                double unknown = 0 * (rule.least + rule.most);
                double error = rule.error + rule.slope_error * moved + TINY * (1 + bent) * (1 + moved);
                r.s[l] = steep * x->s[l] + error + slack * size + unknown;
            }
            for (int i = first; i < last; i++)
                EACH t[i][l] = slopes[l] * ax[i][l];
        }
        }
        settle(v, n, first, last, slack, &r, t);
    }
}

#endif
