/* Interpreter of a tape in first-order or second-order forms over LANES boxes.
 * Reference in NumPy: tests/reference/numpy_engine/first_order.py and tests/reference/numpy_engine/second_order.py. */
#ifndef FORMS_H
#define FORMS_H

#include "univariate.h"

/* Largest number of variables of a second-order form: bits of an unsigned number. */
#define MOST_VARIABLES 15

/* Coefficients of a second-order form that may differ from 0, as bits: a, and the rows of the symmetric Q. */
typedef struct {
    unsigned linear, pairs[MOST_VARIABLES];
} Terms;

/* c + a e + Q(e) + [p, q] +- s over LANES boxes, with the sum of |a| and Q's range [sl, sh]; and an interval. The n
 * coefficients a follow in memory. Second-order forms then have the coefficients of e_i e_j, i <= j, row by row; memory is
 * 0 at first, and unused coefficients stay 0. In first-order forms Q is 0. */
typedef struct {
    Lane c, p, q, s, lo, hi, rad, sl, sh;
    Terms terms;
} Value;

typedef struct {
    Lane c, p, q, s, lo, hi;
} Result;

typedef struct {
    double *memory;
    size_t stride; /* doubles of a value with its coefficients */
} Store;

static inline Value *value_of(Store s, int i) { return (Value *)(s.memory + (size_t)i * s.stride); }
static inline Lane *terms_of(const Value *v) { return (Lane *)(v + 1); }
/* Index of the coefficient of e_i e_j, i <= j, minus j; the linear coefficients come first. */
static inline int row_of(int n, int i) { return n + i * n - i * (i + 1) / 2; }
static size_t terms_of_order(int n, int order) { return (size_t)(order > 1 ? n * (n + 3) / 2 : n); }

/* The variables i = from, ..., n - 1 of a set of bits. */
#define EACH_OF(i, from, set) for (int i = from; i < n; i++) if ((set) >> i & 1)
/* Loops over the variables, and over the pairs i <= j, of an operation's result. */
#define EACH_VARIABLE(i) for (int i = first; i < last; i++) if (order == 1 || which.linear >> i & 1)
#define EACH_PAIR(i, j) for (int j = i; order > 1 && j < n; j++) if (which.pairs[i] >> j & 1)
/* Writes the linear coefficients t[i], and the coefficients t[at] of pairs, that may differ from 0. */
#define EACH_TERM(single, pair)                                                                                        \
    EACH_VARIABLE(i)                                                                                                   \
    {                                                                                                                  \
        EACH t[i][l] = single;                                                                                         \
        EACH_PAIR(i, j)                                                                                                \
        {                                                                                                              \
            int at = row_of(n, i) + j;                                                                                 \
            EACH t[at][l] = pair;                                                                                      \
        }                                                                                                              \
    }

/* Terms of the sum of two forms; with product, of their product; with dense, of any function of them. */
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

/* Ends of the inverse of an interval without 0, and the absolute value of its end nearest to 0; NaN for other intervals. */
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

/* Range of the product of two linear parts with absolute sums ra and rb: by e_i^2 <= 1 term by term, and by
 * 4 a b = (a + b)^2 - (a - b)^2 with both scaled to the same size. */
INLINE void linear_product(int first, int last, const Lane *a, const double *ra, const Lane *b, const double *rb,
                           double *restrict least, double *restrict most)
{
    Lane balance, sizes, plus, minus;
    EACH balance[l] = sizes[l] = plus[l] = minus[l] = 0.0;
    for (int i = first; i < last; i++)
        EACH
        {
            double product = a[i][l] * b[i][l], one = a[i][l] * rb[l], two = b[i][l] * ra[l];
            balance[l] += product, sizes[l] += fabs(product);
            plus[l] += fabs(one + two), minus[l] += fabs(one - two);
        }
    EACH
    {
        double both = ra[l] * rb[l], cross = both - sizes[l], quarter = 0.25 / (both > 0 ? both : 1.0);
        double up = 0.5 * (sizes[l] + balance[l]) + cross, down = 0.5 * (sizes[l] - balance[l]) + cross;
        /* This order avoids underflow of the square of a sum. */
        double more = plus[l] * (plus[l] * quarter), less = minus[l] * (minus[l] * quarter);
        most[l] = more < up ? more : up, least[l] = -(less < down ? less : down);
    }
}

/* The variables k for which e_i e_j e_k may be a term of the product of a linear and a quadratic part. */
INLINE unsigned cubic_terms(Terms a, Terms Q, int i, int j)
{
    return (a.linear >> i & 1 ? Q.pairs[j] : 0) | (a.linear >> j & 1 ? Q.pairs[i] : 0) | (Q.pairs[i] >> j & 1 ? a.linear : 0);
}

/* Adds the absolute values of the coefficients of (a e) P(e) + (b e) Q(e), monomial by monomial. */
INLINE void add_cubic_sizes(int n, Terms x, Terms y, const Lane *a, const Lane *Q, const Lane *b, const Lane *P,
                            double *restrict out)
{
    EACH_OF(i, 0, x.linear | y.linear)
    {
        const Lane *Qi = Q + row_of(n, i), *Pi = P + row_of(n, i);
        if ((cubic_terms(x, y, i, i) | cubic_terms(y, x, i, i)) >> i & 1)
            EACH out[l] += fabs(a[i][l] * Pi[i][l] + b[i][l] * Qi[i][l]);
        EACH_OF(j, i + 1, x.linear | y.linear)
        {
            const Lane *Qj = Q + row_of(n, j), *Pj = P + row_of(n, j);
            unsigned third = cubic_terms(x, y, i, j) | cubic_terms(y, x, i, j);
            if (third >> i & 1 || third >> j & 1)
                EACH out[l] += fabs((a[i][l] * Pi[j][l] + a[j][l] * Pi[i][l]) + (b[i][l] * Qi[j][l] + b[j][l] * Qi[i][l])) +
                               fabs((a[i][l] * Pj[j][l] + a[j][l] * Pi[j][l]) + (b[i][l] * Qj[j][l] + b[j][l] * Qi[j][l]));
            EACH_OF(k, j + 1, third)
                EACH out[l] += fabs((a[i][l] * Pj[k][l] + a[j][l] * Pi[k][l] + a[k][l] * Pi[j][l]) +
                                    (b[i][l] * Qj[k][l] + b[j][l] * Qi[k][l] + b[k][l] * Qi[j][l]));
        }
    }
}

/* Copies the coefficients t into a form: from first to last, or only the terms that may differ from 0. */
INLINE void write_terms(Value *v, int n, int order, int first, int last, Terms terms, const Lane *t)
{
    Lane *to = terms_of(v);
    if (order == 1) {
        memset(to, 0, (size_t)first * sizeof(Lane));
        memcpy(to + first, t + first, (size_t)(last - first) * sizeof(Lane));
        memset(to + last, 0, (size_t)(n - last) * sizeof(Lane));
        return;
    }
    EACH_OF(i, 0, terms.linear | v->terms.linear)
    {
        int at = row_of(n, i);
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

/* Writes a value with the coefficients t: poisons it without a finite form, and intersects the interval with the form's
 * range. */
INLINE void settle(Value *restrict v, int n, int order, int first, int last, Terms which, double slack,
                   const Result *restrict from, Lane *restrict t)
{
    Lane *terms = terms_of(v), rad, least, most;
    double grown = 1 + slack;
    int all = 1;
    EACH rad[l] = least[l] = most[l] = 0.0;
    EACH_VARIABLE(i)
    {
        EACH rad[l] += fabs(t[i][l]);
        EACH_PAIR(i, j)
        {
            const double *term = t[row_of(n, i) + j];
            if (i == j)
                EACH least[l] += smaller(term[l], 0.0), most[l] += larger(term[l], 0.0);
            else
                EACH least[l] -= fabs(term[l]), most[l] += fabs(term[l]);
        }
    }
    EACH
    {
        double c = from->c[l], p = smaller(from->p[l] * grown, 0.0), q = larger(from->q[l] * grown, 0.0);
        double s = from->s[l] * grown, ends = ULP * fabs(c) + s;
        double down = (rad[l] - least[l] - p + ends) * grown, up = (rad[l] + most[l] + q + ends) * grown;
        int good = (down < LARGEST) & (up < LARGEST) & (fabs(c) < LARGEST);
        double low = c - down, high = c + up;
        low = low - ULP * fabs(low), high = high + ULP * fabs(high);
        double lo = from->lo[l] > low ? from->lo[l] : low, hi = from->hi[l] < high ? from->hi[l] : high;
        all &= good;
        v->c[l] = good ? c : 0.0, v->rad[l] = good ? rad[l] : 0.0;
        v->p[l] = good ? p : 0.0, v->q[l] = good ? q : 0.0, v->s[l] = good ? s : INFINITY;
        v->lo[l] = good ? lo : -INFINITY, v->hi[l] = good ? hi : INFINITY;
        if (order > 1)
            v->sl[l] = good ? least[l] : 0.0, v->sh[l] = good ? most[l] : 0.0;
    }
    write_terms(v, n, order, first, last, which, t);
    for (size_t i = 0; !all && i < terms_of_order(n, order); i++)
        EACH terms[i][l] = v->s[l] < INFINITY ? terms[i][l] : 0.0;
}

/* Width and largest absolute value of the quadratic part, and largest absolute value of the remainder. */
#define SPREAD(x) (order > 1 ? x->sh[l] - x->sl[l] : 0.0)
#define CURVED(x) (order > 1 ? larger(-x->sl[l], x->sh[l]) : 0.0)
#define REST(x) larger(-x->p[l], x->q[l])

/* Order of a box's data in memory. */
enum { CENTRE, RADIUS, LOWER, UPPER };

INLINE void interpret(int order, const Tape *tape, int n, Store work, Store out, Lane *const *box, Lane *restrict t)
{
    const Terms none = {0};
    /* Upper bound of the roundings of each term in one operation: the number of monomials of third order, or of variables. */
    double slack = ((double)(order > 1 ? n * (n + 1) * (n + 2) / 6 + 16 : n + 8)) * ULP;
    for (int index = 0; index < tape->length; index++) {
        const int *code = tape->code + 6 * index;
        int op = code[0], first = code[4], last = code[5];
        double k = tape->k[index];
        Value *v = value_of(op == OUTPUT ? out : work, code[1]);
        if (op == OUTPUT) {
            const Value *from = value_of(work, code[2]);
            memcpy(v, from, offsetof(Value, terms));
            write_terms(v, n, order, 0, n, from->terms, terms_of(from));
            continue;
        }
        if (op == INPUT || op == CONSTANT) {
            write_terms(v, n, order, 0, 0, none, t);
            memset(v, 0, offsetof(Value, terms));
            EACH v->c[l] = v->lo[l] = v->hi[l] = k;
        }
        if (op == INPUT) {
            memcpy(v->c, box[CENTRE][code[2]], sizeof(Lane));
            memcpy(v->lo, box[LOWER][code[2]], sizeof(Lane));
            memcpy(v->hi, box[UPPER][code[2]], sizeof(Lane));
            memcpy(v->rad, box[RADIUS][code[2]], sizeof(Lane));
            memcpy(terms_of(v)[code[2]], box[RADIUS][code[2]], sizeof(Lane));
            v->terms.linear = order > 1 ? 1u << code[2] : 0;
        }
        if (op == INPUT || op == CONSTANT)
            continue;
        const Value *x = value_of(work, code[2]), *y = value_of(work, code[3]);
        const Lane *ax = terms_of(x), *ay = terms_of(y);
        Terms X = none, Y = none, which = none;
        if (order > 1) {
            int is_product = op == MUL || op == SQUARE, is_sum = op == ADD || op == SUB || op == SHIFT || op == SCALE;
            X = x->terms, Y = y->terms; /* an operation on one value reads it twice */
            which = structure_of(n, X, Y, is_product, !is_sum && !is_product);
        }
        Lane least, most; /* range of the terms of the next order */
        EACH least[l] = most[l] = 0.0;
        Result r;
        switch (op) {
        case ADD:
        case SUB: {
            double sign = op == ADD ? 1.0 : -1.0;
            const double *p = op == ADD ? y->p : y->q, *q = op == ADD ? y->q : y->p;
            const double *low = op == ADD ? y->lo : y->hi, *high = op == ADD ? y->hi : y->lo;
            EACH_TERM(ax[i][l] + sign * ay[i][l], ax[at][l] + sign * ay[at][l])
            EACH
            {
                double c = x->c[l] + sign * y->c[l], lo = x->lo[l] + sign * low[l], hi = x->hi[l] + sign * high[l];
                double size = fabs(c) + ((x->rad[l] + y->rad[l]) + (SPREAD(x) + SPREAD(y)));
                r.c[l] = c, r.p[l] = x->p[l] + sign * p[l], r.q[l] = x->q[l] + sign * q[l];
                r.s[l] = x->s[l] + y->s[l] + slack * size;
                r.lo[l] = lo - fabs(lo) * ULP, r.hi[l] = hi + fabs(hi) * ULP;
            }
            break;
        }
        case SHIFT:
            EACH_TERM(ax[i][l], ax[at][l])
            EACH
            {
                double c = x->c[l] + k, lo = x->lo[l] + k, hi = x->hi[l] + k;
                r.c[l] = c, r.p[l] = x->p[l], r.q[l] = x->q[l], r.s[l] = x->s[l] + slack * fabs(c);
                r.lo[l] = lo - fabs(lo) * ULP, r.hi[l] = hi + fabs(hi) * ULP;
            }
            break;
        case SCALE: {
            double size = fabs(k);
            EACH_TERM(ax[i][l] * k, ax[at][l] * k)
            EACH
            {
                double c = x->c[l] * k, down = x->lo[l] * k, up = x->hi[l] * k, p = x->p[l] * k, q = x->q[l] * k;
                double lo = k >= 0 ? down : up, hi = k >= 0 ? up : down, all = fabs(c) + size * (x->rad[l] + SPREAD(x));
                r.c[l] = c, r.p[l] = k >= 0 ? p : q, r.q[l] = k >= 0 ? q : p;
                /* Factors 1 and -1 cause no rounding. */
                r.s[l] = size == 1 ? x->s[l] : x->s[l] * size + (slack * all + TINY);
                r.lo[l] = size == 1 ? lo : lo - (fabs(lo) * ULP + TINY);
                r.hi[l] = size == 1 ? hi : hi + (fabs(hi) * ULP + TINY);
            }
            break;
        }
        case MUL:
            EACH_TERM(x->c[l] * ay[i][l] + y->c[l] * ax[i][l],
                      (x->c[l] * ay[at][l] + y->c[l] * ax[at][l]) +
                          (i == j ? ax[i][l] * ay[i][l] : ax[i][l] * ay[j][l] + ax[j][l] * ay[i][l]))
            if (order == 1)
                linear_product(first, last, ax, x->rad, ay, y->rad, least, most);
            else {
                add_cubic_sizes(n, X, Y, ax, ax, ay, ay, most);
                EACH most[l] += CURVED(x) * CURVED(y), least[l] = -most[l];
            }
            EACH
            {
                double cx = x->c[l], cy = y->c[l], px = x->p[l], qx = x->q[l], py = y->p[l], qy = y->q[l];
                double rx = x->rad[l] + CURVED(x), ry = y->rad[l] + CURVED(y), mx = REST(x), my = REST(y);
                double mixed = rx * my + ry * mx + mx * my;
                double big = fabs(cx) + x->rad[l] + SPREAD(x) + mx, other = fabs(cy) + y->rad[l] + SPREAD(y) + my;
                r.c[l] = cx * cy;
                r.p[l] = smaller(cx * py, cx * qy) + smaller(cy * px, cy * qx) + (least[l] - mixed);
                r.q[l] = larger(cx * py, cx * qy) + larger(cy * px, cy * qx) + (most[l] + mixed);
                r.s[l] = (big * y->s[l] + other * x->s[l] + x->s[l] * y->s[l]) + (slack * (big * other) + TINY);
            }
            interval_product(x->lo, x->hi, y->lo, y->hi, &r);
            break;
        case SQUARE:
            EACH_TERM(2 * x->c[l] * ax[i][l],
                      2 * x->c[l] * ax[at][l] + (i == j ? 1.0 : 2.0) * (ax[i][l] * ax[j][l]))
            if (order > 1)
                add_cubic_sizes(n, X, X, ax, ax, ax, ax, most);
            EACH
            {
                double c = x->c[l], rad = x->rad[l], p = x->p[l], q = x->q[l], s = x->s[l], m = REST(x);
                double mixed = most[l] + 2 * rad * m, size = fabs(c) + rad + SPREAD(x) + m;
                /* Two bounds of the square: terms of second and higher order together, or each order separately. */
                double square = order > 1 ? (CURVED(x) + m) * (CURVED(x) + m) : rad * rad + m * m;
                r.c[l] = c * c;
                r.p[l] = smaller(2 * c * p, 2 * c * q) - mixed;
                r.q[l] = larger(2 * c * p, 2 * c * q) + (mixed + square);
                r.s[l] = 2 * size * s + s * s + (slack * (size * size) + TINY);
            }
            square_ends(x, &r);
            break;
        case DIV: {
            /* P + (x - P y) / y, with the quotient's terms P up to the order of the forms. */
            Lane ratio, inverse, near, rad, size, low, high;
            inverse_ends(y, near, low, high);
            EACH inverse[l] = 1.0 / y->c[l], ratio[l] = x->c[l] / y->c[l], rad[l] = size[l] = 0.0;
            EACH_VARIABLE(i)
                EACH
                {
                    t[i][l] = (ax[i][l] - ratio[l] * ay[i][l]) * inverse[l];
                    rad[l] += fabs(t[i][l]);
                }
            EACH_VARIABLE(i)
                EACH_PAIR(i, j)
                {
                    int at = row_of(n, i) + j;
                    EACH
                    {
                        double crossed = t[i][l] * ay[j][l] + (i == j ? 0.0 : t[j][l] * ay[i][l]);
                        t[at][l] = ((ax[at][l] - ratio[l] * ay[at][l]) - crossed) * inverse[l];
                        size[l] += fabs(t[at][l]);
                    }
                }
            if (order == 1)
                linear_product(first, last, t, rad, ay, y->rad, least, most);
            else {
                add_cubic_sizes(n, which, Y, t, t, ay, ay, most);
                EACH most[l] += size[l] * CURVED(y), least[l] = -most[l];
            }
            EACH
            {
                int positive = y->lo[l] > 0;
                double by = ratio[l], py = y->p[l], qy = y->q[l], my = REST(y), moved = rad[l] + size[l];
                double p = x->p[l] - larger(by * py, by * qy) - (most[l] + moved * my);
                double q = x->q[l] - smaller(by * py, by * qy) - (least[l] - moved * my);
                double whole = fabs(by) + moved, ylong = fabs(y->c[l]) + y->rad[l] + SPREAD(y) + my;
                double xlong = fabs(x->c[l]) + x->rad[l] + SPREAD(x);
                double s = x->s[l] + whole * y->s[l] + (slack * (xlong + whole * ylong) + TINY * (1 + ylong));
                r.c[l] = by, r.s[l] = s / near[l] + (slack * whole + TINY);
                r.p[l] = (positive ? p : -q) / near[l], r.q[l] = (positive ? q : -p) / near[l];
            }
            interval_product(x->lo, x->hi, low, high, &r);
            break;
        }
        default: {
            Lane slopes, curves;
            if (order > 1)
                add_cubic_sizes(n, X, X, ax, ax, ax, ax, most);
            EACH
            {
                Rule rule = rule_of(op, x->c[l], x->lo[l], x->hi[l]);
                double slope = rule.slope, curve = order > 1 ? rule.curve : 0.0;
                double p = x->p[l], q = x->q[l], s = x->s[l], m = REST(x), S = CURVED(x) + m, rad = x->rad[l];
                double moved = rad + SPREAD(x) + m, reach = moved + s, further = order > 1 ? moved + moved * moved : moved;
                double mixed = most[l] + 2 * rad * m, square = mixed + S * S;
                double up = reach * reach * (reach / 6), down = -up, bend = fabs(curve);
                if (order == 1) /* [p, q] shrinks with the box, s does not */
                    down = rule.least * (moved * moved), up = rule.most * (moved * moved), bend = larger(fabs(rule.least), fabs(rule.most));
                else if (op != SIN && op != COS) {
                    double blur = (fabs(rule.least) + fabs(rule.most) + bend) * ULP;
                    down = (rule.least - curve - blur) * (reach * reach), up = (rule.most - curve + blur) * (reach * reach);
                }
                slopes[l] = slope, curves[l] = curve;
                r.c[l] = rule.value, r.lo[l] = rule.lo, r.hi[l] = rule.hi;
                r.p[l] = smaller(slope * p, slope * q) + smaller(curve * -mixed, curve * square) + smaller(down, 0.0);
                r.q[l] = larger(slope * p, slope * q) + larger(curve * -mixed, curve * square) + larger(up, 0.0);
                double steep = fabs(slope) + 2 * bend * reach;
                double size = fabs(rule.value) + fabs(slope) * moved + fabs(curve) * (moved * moved);
                /* larger() and smaller() drop a NaN, but a NaN in the rule must poison the value. */
                double unknown = 0 * (down + up), lost = TINY * (1 + fabs(curve) + fabs(rule.least) + fabs(rule.most));
                r.s[l] = steep * s + (rule.error + rule.slope_error * further + lost * (1 + further)) + slack * size + unknown;
            }
            EACH_TERM(slopes[l] * ax[i][l],
                      slopes[l] * ax[at][l] + (i == j ? 1.0 : 2.0) * curves[l] * (ax[i][l] * ax[j][l]))
        }
        }
        settle(v, n, order, first, last, which, slack, &r, t);
    }
}

WIDE static void run1(const Tape *tape, int n, Store work, Store out, Lane *const *box, Lane *restrict t)
{
    interpret(1, tape, n, work, out, box, t);
}

WIDE static void run2(const Tape *tape, int n, Store work, Store out, Lane *const *box, Lane *restrict t)
{
    interpret(2, tape, n, work, out, box, t);
}

#endif
