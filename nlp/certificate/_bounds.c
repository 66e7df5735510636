/* Kernel of the search of a whole box: the examination of boxes, as in enclosure.py, univariate.py, quadratic.py and
 * bounding.py.
 *
 * The tape is interpreted over LANES boxes at once, so that an instruction is fetched once for all of them and its
 * loops become vector instructions; the boxes are then examined one by one. Every formula is that of the Python
 * modules, in the same order; their docstrings and docs/certificate.md explain them.
 *
 * Rounding is to nearest. Never compile this with -ffast-math, which would drop the tests for NaN that keep boxes open;
 * nor with contraction to fused operations, which would make the two engines differ.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(__GNUC__) && __GNUC__ >= 12 && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__)
#define WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define WIDE
#endif

#define INLINE static inline __attribute__((always_inline))
#define LANES 32
#define EACH for (int l = 0; l < LANES; l++)
#define ULP 0x1p-51
#define TINY 1e-300
#define LIBRARY 8.0
#define WORTH 0.1
#define LINEAR 0.3
#define ROOT_SLACK 1e-12
#define MULTIPLIER_ROUNDS 8
#define TANGENT_ROUNDS 3

enum { CONSTANT, INPUT, OUTPUT, ADD, SUB, MUL, DIV, SHIFT, SCALE, SQUARE, SQRT, SIN, COS, EXP, LOG, ATAN, RAMP, STEP };
enum { OPEN, BOUNDED, INFEASIBLE, MONOTONE, EMPTIED };

typedef double Lane[LANES];

/* An enclosure over LANES boxes: form, interval, and the sum of |a|. The n coefficients a follow it in memory. */
typedef struct {
    Lane c, p, q, s, lo, hi, rad;
} Value;

typedef struct {
    const int *code; /* op, to, a, b, first, last */
    const double *k;
    int length, registers, outputs;
} Tape;

typedef struct {
    int n, functions, expressions; /* R expressions, the functions first, then the conditions */
    const int *equation;      /* (R) whether it must be 0 */
    const int *depends;       /* (R, n) whether it depends on a variable */
    const double *low, *high; /* (n) ends of the whole box */
    Tape tape;
} Form;

typedef struct {
    double *memory;
    size_t stride; /* doubles of a value with its coefficients */
} Store;

static inline Value *value_of(Store s, int i) { return (Value *)(s.memory + (size_t)i * s.stride); }
static inline Lane *terms_of(Value *v) { return (Lane *)(v + 1); }
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

/* ---- Functions of one variable: f(c) + f'(c) Y + [least, most] Y^2, and their ranges; univariate.py. ---- */

typedef struct {
    double value, slope, least, most, error, lo, hi;
} Rule;

#define OFF (LIBRARY * ULP)

static Rule wave(double c, double lo, double hi, int shifted)
{
    double middle = 0.5 * lo + 0.5 * hi, radius = larger(hi - middle, middle - lo) * (1 + ULP) + TINY;
    double centred = shifted ? cos(middle) : sin(middle), steep = fabs(shifted ? sin(middle) : cos(middle));
    double spread = steep * radius + 0.5 * radius * radius;
    spread = spread + 2 * OFF * (1 + spread);
    double least = larger(centred - spread, -1.0), most = smaller(centred + spread, 1.0);
    double sine = sin(c), cosine = cos(c);
    Rule r = {shifted ? cosine : sine, shifted ? -sine : cosine, -0.5 * most, -0.5 * least, 4 * OFF, least, most};
    return r;
}

static Rule rule_of(int op, double c, double lo, double hi)
{
    Rule r = {NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    lo = smaller(lo, c), hi = larger(hi, c);
    if (op == SQRT && lo >= 0) { /* below 0 it stays NaN: smaller and larger would lose a NaN of least alone */
        double root = sqrt(c), low = sqrt(lo), high = sqrt(hi), slope = 0.5 / root;
        r.value = root, r.slope = slope, r.error = OFF * root;
        r.least = -slope / ((low + root) * (low + root)), r.most = -slope / ((high + root) * (high + root));
        r.lo = low - fabs(low) * ULP, r.hi = high + fabs(high) * ULP;
    } else if (op == SIN || op == COS) {
        r = wave(c, lo, hi, op == COS);
    } else if (op == EXP) {
        r.value = r.slope = exp(c), r.error = 2 * OFF * r.value;
        r.lo = larger(exp(lo) * (1 - OFF) - TINY, 0.0), r.hi = exp(hi) * (1 + OFF) + TINY;
        r.least = 0.5 * r.lo, r.most = 0.5 * r.hi;
    } else if (op == LOG && lo > 0) {
        double low = log(lo), high = log(hi), grown = 1 + OFF;
        r.value = log(c), r.slope = 1 / c, r.error = 2 * OFF * (fabs(r.value) + r.slope);
        r.least = -0.5 * grown / (lo * lo), r.most = -0.5 / (grown * hi * hi);
        r.lo = low - (fabs(low) * OFF + TINY), r.hi = high + (fabs(high) * OFF + TINY);
    } else if (op == RAMP) {
        int kink = lo < 0 && hi > 0;
        double slope = lo >= 0 ? 1.0 : hi <= 0 ? 0.0 : hi / (hi - lo), half = kink ? -0.5 * slope * lo : 0.0;
        r.value = slope * c + half, r.slope = slope, r.least = r.most = 0.0;
        r.error = half + (kink ? 8 * ULP * (hi - lo) + TINY : 0.0);
        r.lo = larger(lo, 0.0), r.hi = larger(hi, 0.0);
    } else if (op == STEP) {
        r.lo = lo > 0 ? 1.0 : 0.0, r.hi = hi < 0 ? 0.0 : 1.0;
        r.value = 0.5 * (r.lo + r.hi), r.error = 0.5 * (r.hi - r.lo), r.slope = r.least = r.most = 0.0;
    } else if (op == ATAN) {
        double low = atan(lo), high = atan(hi);
        r.value = atan(c), r.slope = 1 / (1 + c * c), r.error = 2 * OFF * (fabs(r.value) + 1);
        r.most = lo >= 0 ? 0.0 : smaller(0.325, -lo * (1 + ULP));
        r.least = hi <= 0 ? 0.0 : larger(-0.325, -hi * (1 + ULP));
        r.lo = low - (fabs(low) * OFF + TINY), r.hi = high + (fabs(high) * OFF + TINY);
    }
    return r;
}

/* ---- The interpreter; enclosure.py. ---- */

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
        double more = plus[l] * plus[l] * quarter, less = minus[l] * minus[l] * quarter;
        most = more < most ? more : most, least = less < least ? less : least;
        double mx = larger(-px, qx), my = larger(-py, qy), mixed = rx * my + ry * mx + mx * my;
        out->p[l] = smaller(cx * py, cx * qy) + smaller(cy * px, cy * qx) - (least + mixed);
        out->q[l] = larger(cx * py, cx * qy) + larger(cy * px, cy * qx) + (most + mixed);
        big[l] = fabs(cx) + rx + mx, other[l] = fabs(cy) + ry + my;
    }
}

/* Writes a value: poisons one without a finite form, intersects the interval with the form's range. */
INLINE void settle(Value *restrict v, int n, int first, int last, double slack, const Result *restrict from,
                   Lane *restrict t)
{
    Lane *a = terms_of(v);
    double grown = 1 + slack;
    int all = 1;
    EACH v->rad[l] = 0.0;
    for (int i = first; i < last; i++)
        EACH v->rad[l] += fabs(t[i][l]);
    EACH
    {
        double c = from->c[l], p = smaller(from->p[l] * grown, 0.0), q = larger(from->q[l] * grown, 0.0);
        double s = from->s[l] * grown, ends = ULP * fabs(c) + s, rad = v->rad[l];
        double down = (rad - p + ends) * grown, up = (rad + q + ends) * grown;
        int good = (down < INFINITY) & (up < INFINITY) & (fabs(c) < INFINITY);
        double low = c - down, high = c + up;
        low = low - ULP * fabs(low), high = high + ULP * fabs(high);
        double lo = from->lo[l] > low ? from->lo[l] : low, hi = from->hi[l] < high ? from->hi[l] : high;
        all &= good;
        v->c[l] = good ? c : 0.0, v->rad[l] = good ? rad : 0.0;
        v->p[l] = good ? p : 0.0, v->q[l] = good ? q : 0.0, v->s[l] = good ? s : INFINITY;
        v->lo[l] = good ? lo : -INFINITY, v->hi[l] = good ? hi : INFINITY;
    }
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
            EACH
            {
                double c = x->c[l] + y->c[l], lo = x->lo[l] + y->lo[l], hi = x->hi[l] + y->hi[l];
                r.c[l] = c, r.p[l] = x->p[l] + y->p[l], r.q[l] = x->q[l] + y->q[l];
                r.s[l] = x->s[l] + y->s[l] + slack * (fabs(c) + x->rad[l] + y->rad[l]);
                r.lo[l] = lo - fabs(lo) * ULP, r.hi[l] = hi + fabs(hi) * ULP;
            }
            break;
        case SUB:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l] - ay[i][l];
            EACH
            {
                double c = x->c[l] - y->c[l], lo = x->lo[l] - y->hi[l], hi = x->hi[l] - y->lo[l];
                r.c[l] = c, r.p[l] = x->p[l] - y->q[l], r.q[l] = x->q[l] - y->p[l];
                r.s[l] = x->s[l] + y->s[l] + slack * (fabs(c) + x->rad[l] + y->rad[l]);
                r.lo[l] = lo - fabs(lo) * ULP, r.hi[l] = hi + fabs(hi) * ULP;
            }
            break;
        case SHIFT:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l];
            EACH
            {
                double c = x->c[l] + k, lo = x->lo[l] + k, hi = x->hi[l] + k;
                r.c[l] = c, r.p[l] = x->p[l], r.q[l] = x->q[l], r.s[l] = x->s[l] + slack * fabs(c);
                r.lo[l] = lo - fabs(lo) * ULP, r.hi[l] = hi + fabs(hi) * ULP;
            }
            break;
        case SCALE: {
            double size = fabs(k);
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l] * k;
            EACH
            {
                double c = x->c[l] * k, down = x->lo[l] * k, up = x->hi[l] * k, p = x->p[l] * k, q = x->q[l] * k;
                double lo = k >= 0 ? down : up, hi = k >= 0 ? up : down;
                r.c[l] = c, r.p[l] = k >= 0 ? p : q, r.q[l] = k >= 0 ? q : p;
                r.s[l] = size == 1 ? x->s[l] : x->s[l] * size + (slack * (fabs(c) + size * x->rad[l]) + TINY);
                r.lo[l] = size == 1 ? lo : lo - (fabs(lo) * ULP + TINY);
                r.hi[l] = size == 1 ? hi : hi + (fabs(hi) * ULP + TINY);
            }
            break;
        }
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
                double one = fabs(x->lo[l]), two = fabs(x->hi[l]);
                double small = one < two ? one : two, large = one < two ? two : one;
                small = (x->lo[l] <= 0) & (x->hi[l] >= 0) ? 0.0 : small;
                double lo = small * small, hi = large * large;
                lo = lo - (lo * ULP + TINY);
                r.lo[l] = lo > 0.0 ? lo : 0.0, r.hi[l] = hi + (hi * ULP + TINY);
            }
            break;
        case DIV: {
            Lane zero, ratio, inverse, steep, pi, qi, ri, si, pn, qn, rn, sn, low, high;
            EACH
            {
                int positive = y->lo[l] > 0;
                double c = y->c[l], near = positive ? y->lo[l] : -y->hi[l], far = positive ? y->hi[l] : -y->lo[l];
                near = near > 0 ? near : NAN;
                double my = larger(-y->p[l], y->q[l]), moved = y->rad[l] + my;
                inverse[l] = 1.0 / c, steep[l] = inverse[l] * inverse[l];
                double curved = moved * moved * steep[l] / near, p = -steep[l] * y->q[l], q = -steep[l] * y->p[l];
                pi[l] = positive ? p : p - curved, qi[l] = positive ? q + curved : q, ri[l] = steep[l] * y->rad[l];
                double size = fabs(inverse[l]) + ri[l] + larger(-pi[l], qi[l]);
                si[l] = y->s[l] * steep[l] * (1 + (2 * moved + y->s[l]) / near) + (slack * size + TINY);
                double by = x->c[l] / c, steepness = fabs(by);
                ratio[l] = by;
                pn[l] = x->p[l] - (by >= 0 ? by * y->q[l] : by * y->p[l]);
                qn[l] = x->q[l] - (by >= 0 ? by * y->p[l] : by * y->q[l]);
                double all = fabs(x->c[l]) + x->rad[l] + steepness * (fabs(c) + y->rad[l]);
                sn[l] = x->s[l] + steepness * y->s[l] + (slack * all + TINY);
                double one = (positive ? 1.0 : -1.0) / far, two = (positive ? 1.0 : -1.0) / near;
                double least = one < two ? one : two, most = one < two ? two : one;
                low[l] = least - (fabs(least) * ULP + TINY), high[l] = most + (fabs(most) * ULP + TINY);
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
                double steep = fabs(slope) + 2 * larger(fabs(rule.least), fabs(rule.most)) * (moved + x->s[l]);
                double size = fabs(slope) * moved + fabs(rule.value);
                r.s[l] = steep * x->s[l] + rule.error * (1 + moved) + (slack * size + TINY);
            }
            for (int i = first; i < last; i++)
                EACH t[i][l] = slopes[l] * ax[i][l];
        }
        }
        settle(v, n, first, last, slack, &r, t);
    }
}

/* ---- The examination of one box; bounding.py and quadratic.py. ---- */

/* Enclosures of the expressions over one box, and an upper model middle + b e + 1/2 e'He + w |e| of a weighted sum. */
typedef struct {
    int n, J, R;
    double *c, *p, *q, *s, *lo, *hi, *a;  /* (R), a: (R, n): enclosures of the expressions */
    double *gb, *gA, *gp, *gq, *gs;       /* (R, n), gA: (R, n, n): forms of their gradients, times r_i */
    double *slope_lo, *slope_hi;  /* (R, n) interval gradients, times r_i */
    double *grad_lo, *grad_hi;    /* (R, n) interval gradients */
    double *weights, *size, *left, *high, *low; /* (R), (R), (n), (R), (R) */
    double *qb, *qw, *qlo, *qhi, *H;            /* (n), H: (n, n): the Lagrangian's model */
    double *sign, *fb, *fw, *fH, *diagonal, *t, *gradient; /* (n), fH: (n, n) */
    double *e_lo, *e_hi;
    int *why_lo, *why_hi;
    double q_middle, q_rounding;
} Box;

/* The gradient is made small in the variables from number first on. */
static void choose_multipliers(Box *x, const int *equation, int first)
{
    int n = x->n, J = x->J, R = x->R;
    for (int r = 0; r < R; r++) {
        x->weights[r] = r == 0;
        x->size[r] = 0.0;
        for (int i = first; i < n; i++) {
            double along = x->gb[r * n + i] - (r < J ? x->gb[i] : 0.0);
            x->size[r] += along * along;
        }
    }
    memcpy(x->left, x->gb, (size_t)n * sizeof(double));
    for (int round = 0; round < (R > 1 ? MULTIPLIER_ROUNDS : 0); round++)
        for (int r = 1; r < R; r++) {
            if (!(x->size[r] > 0 && x->size[r] < INFINITY && (r < J || x->high[r] >= 0)))
                continue;
            double product = 0.0, weight = x->weights[r];
            for (int i = first; i < n; i++)
                product += (x->gb[r * n + i] - (r < J ? x->gb[i] : 0.0)) * x->left[i];
            double new = weight - product / x->size[r];
            if (r < J)
                new = smaller(larger(new, 0.0), weight + x->weights[0]);
            else if (!equation[r])
                new = smaller(new, 0.0);
            if (!isfinite(new))
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

/* One variable's part of a model, from the parts of a gradient's form: quadratic.py's _integrate. */
static double finish_model(double *b, double *w, double *low, double *high, double across, double p, double q, double s)
{
    double margin = 64 * ULP * (fabs(*b) + across + q - p + s) + TINY;
    double least = *b - across + p - s, most = *b + across + q + s;
    *low = (*low > least || isnan(least) ? *low : least) - margin;
    *high = (*high < most || isnan(most) ? *high : most) + margin;
    double lost = fabs(*b) + 2 * across + q - p + s;
    *w = (q - p) / 6 + s, *b = *b + (p + q) / 6;
    return lost;
}

static void combine(Box *x)
{
    int n = x->n, R = x->R;
    double largest = 0.0, lost = 0.0, middle = 0.0, error = 0.0;
    for (int r = 0; r < R; r++)
        if (x->weights[r] != 0) {
            double size = fabs(x->weights[r]);
            middle += x->c[r] * x->weights[r], error += x->s[r] * size;
            largest += fabs(x->c[r]) * size;
        }
    x->q_middle = middle + error;
    for (int i = 0; i < n; i++) {
        double b = 0.0, s = 0.0, p = 0.0, q = 0.0, low = 0.0, high = 0.0, across = 0.0;
        double *H = x->H + i * n;
        memset(H, 0, (size_t)n * sizeof(double));
        for (int r = 0; r < R; r++) {
            double weight = x->weights[r];
            int at = r * n + i, up = weight > 0;
            if (weight == 0)
                continue;
            b += x->gb[at] * weight, s += x->gs[at] * fabs(weight);
            p += (up ? x->gp[at] : x->gq[at]) * weight, q += (up ? x->gq[at] : x->gp[at]) * weight;
            low += (up ? x->slope_lo[at] : x->slope_hi[at]) * weight;
            high += (up ? x->slope_hi[at] : x->slope_lo[at]) * weight;
            for (int j = 0; j < n; j++)
                H[j] += x->gA[at * n + j] * weight;
        }
        for (int j = 0; j < n; j++)
            across += fabs(H[j]);
        x->qb[i] = b, x->qlo[i] = low, x->qhi[i] = high;
        lost += finish_model(x->qb + i, x->qw + i, x->qlo + i, x->qhi + i, across, p, q, s);
    }
    x->q_rounding = 64 * ULP * (largest + lost) + TINY;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            x->H[i * n + j] = x->H[j * n + i] = 0.5 * (x->H[i * n + j] + x->H[j * n + i]);
}

/* Largest linear t + 1/2 quadratic t^2 for t in [0, 1], linear not negative. */
static double largest_of(double linear, double quadratic)
{
    if (quadratic < 0 && linear < -quadratic)
        return linear * linear / (-2 * quadratic);
    return linear + 0.5 * quadratic;
}

static double quadratic_bound(Box *x)
{
    int n = x->n;
    double mean = x->q_middle, fixed = x->q_middle, separate = 0.0, shifts = 0.0, plane = 0.0;
    for (int i = 0; i < n; i++) {
        mean += larger(fabs(x->qlo[i]), fabs(x->qhi[i]));
        x->sign[i] = x->qlo[i] >= 0 ? 1.0 : x->qhi[i] <= 0 ? -1.0 : 0.0;
    }
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
    double best = mean, other = fixed + separate, third = fixed + plane + shifts;
    best = other < best || isnan(best) ? other : best;
    best = third < best || isnan(best) ? third : best;
    return best + x->q_rounding;
}

/* First and last t in [0, 1] with linear t + 1/2 quadratic t^2 >= need; last < first without one. */
static void roots(double linear, double quadratic, double need, double *first, double *last)
{
    int at_start = need <= 0, at_end = linear + 0.5 * quadratic >= need;
    *first = at_start ? 0.0 : 2.0, *last = at_end ? 1.0 : -1.0;
    if (at_start && at_end)
        return;
    double square = linear * linear + 2 * quadratic * need, root = sqrt(larger(square, 0.0));
    double small = linear >= 0 ? 2 * need / (linear + root) : (root - linear) / quadratic;
    double large = linear >= 0 ? -(linear + root) / quadratic : 2 * need / (linear - root);
    int peak = quadratic < 0 && linear > 0 && linear < -quadratic && linear * linear >= -2 * quadratic * need;
    small = smaller(larger(small, 0.0), 1.0);
    if (at_start)
        *last = quadratic < 0 || linear < 0 ? smaller(larger(large, 0.0), 1.0) : 1.0;
    else if (at_end)
        *first = small;
    else if (peak)
        *first = small, *last = smaller(larger(large, 0.0), 1.0);
}

static void keep(Box *x, int i, double low, double high, int reason)
{
    if (low > x->e_lo[i])
        x->e_lo[i] = low, x->why_lo[i] = reason;
    if (high < x->e_hi[i])
        x->e_hi[i] = high, x->why_hi[i] = reason;
}

/* Ends of the e_i for which a model can reach a level; sign H is the matrix of the model, not made symmetric yet. */
static void reach_quadratic(Box *x, double sign, double middle, const double *b, const double *H, const double *w,
                            double rounding, double level, int reason)
{
    int n = x->n;
    double total = middle + rounding, crossed = 0.0;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < i; j++)
            crossed += fabs(0.5 * (H[i * n + j] + H[j * n + i]));
        x->t[i] = largest_of(fabs(b[i]) + w[i], sign * H[i * n + i]);
        total += x->t[i];
    }
    total += crossed;
    for (int i = 0; i < n; i++) {
        double diagonal = sign * H[i * n + i], linear = b[i], need = level - (total - x->t[i]);
        double size = fabs(need) + fabs(linear) + w[i] + fabs(diagonal) + fabs(total) + fabs(level);
        need = need - (ROOT_SLACK * size + TINY);
        if (!(isfinite(need) && isfinite(linear) && isfinite(w[i]) && isfinite(diagonal)))
            continue;
        if (need <= 0 && linear + w[i] + 0.5 * diagonal >= need && -linear + w[i] + 0.5 * diagonal >= need)
            continue;
        double right_first, right_last, left_first, left_last;
        roots(linear + w[i], diagonal, need, &right_first, &right_last);
        roots(-linear + w[i], diagonal, need, &left_first, &left_last);
        keep(x, i, left_last >= left_first ? -left_last : right_first,
             right_last >= right_first ? right_last : -left_first, reason);
    }
}

static void reach_affine(Box *x, int r, double sign, double level)
{
    int n = x->n;
    const double *a = x->a + r * n;
    double rad = 0.0, most = sign > 0 ? x->q[r] : -x->p[r];
    for (int i = 0; i < n; i++)
        rad += fabs(a[i]);
    double slack = most + x->s[r] + (fabs(x->c[r]) + rad + most + fabs(level)) * (64 * ULP) + TINY;
    for (int i = 0; i < n; i++) {
        double along = sign * a[i], needed = (level - sign * x->c[r] - slack - (rad - fabs(along))) / along;
        double margin = fabs(needed) * (8 * ULP);
        keep(x, i, along > 0 && needed > -1 ? needed - margin : -1.0, along < 0 && needed < 1 ? needed + margin : 1.0, r);
    }
}

static void reach_expression(Box *x, int r, double sign, double level)
{
    int n = x->n;
    const double *A = x->gA + r * n * n;
    double lost = 0.0;
    reach_affine(x, r, sign, level);
    for (int i = 0; i < n; i++) {
        int at = r * n + i;
        double p = sign > 0 ? x->gp[at] : -x->gq[at], q = sign > 0 ? x->gq[at] : -x->gp[at], across = 0.0;
        double low = 0.0, high = 0.0; /* the model's slopes are not used here */
        for (int j = 0; j < n; j++)
            across += fabs(A[i * n + j]);
        x->fb[i] = sign * x->gb[at];
        lost += finish_model(x->fb + i, x->fw + i, &low, &high, across, p, q, x->gs[at]);
    }
    reach_quadratic(x, sign, sign * x->c[r] + x->s[r], x->fb, A, x->fw, 64 * ULP * (fabs(x->c[r]) + lost) + TINY, level, r);
}

/* Arrays of results for B boxes, as in examination.py; the ends and reasons of variable i begin at i * B. */
typedef struct {
    Py_ssize_t B;
    const double *lower, *upper;
    int *verdict, *reason, *split, *cut_lower, *cut_upper;
    double *bound, *value, *left_lower, *left_upper, *centre;
    int shared;     /* number of the first variables that other limbs have too */
    double *models; /* of the Lagrangian and of the function's gradient, limbmodels.py; NULL without them */
} Report;

static Py_ssize_t rows_of_models(int n, int shared) { return 3 + 4 * n + n * n + 4 * shared; }

/* Writes row after row of a box's model: limbmodels.py names them. */
static void write_model(const Form *form, const Box *x, Report *report, Py_ssize_t at, int defined)
{
    int n = x->n, J = x->J, R = x->R;
    double *to = report->models + at;
    const double *vectors[] = {x->qb, x->qw, x->qlo, x->qhi};
    Py_ssize_t B = report->B;
    int holds = 1; /* whether every condition holds on the whole box */
    for (int r = J; r < R; r++)
        holds = holds && !form->equation[r] && x->high[r] < 0;
    *to = defined + 2 * holds, *(to += B) = x->q_middle, *(to += B) = x->q_rounding;
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < n; i++)
            *(to += B) = vectors[k][i];
    for (int i = 0; i < n * n; i++)
        *(to += B) = x->H[i];
    for (int i = 0; i < report->shared; i++) {
        double low = INFINITY, high = -INFINITY;
        int up = 0, down = 0;
        for (int r = 0; r < R; r++) {
            double least = x->grad_lo[r * n + i], most = x->grad_hi[r * n + i];
            if (r < J)
                low = smaller(low, least), high = larger(high, most);
            else if (form->depends[r * n + i] && !(x->high[r] < 0))
                up |= form->equation[r] || !(most < 0), down |= form->equation[r] || !(least > 0);
        }
        *(to += B) = low, *(to += B) = high, *(to += B) = up, *(to += B) = down;
    }
}

static void judge(const Form *form, Box *x, const double *centre, const double *radius, Report *report, Py_ssize_t at,
                  double threshold)
{
    int n = x->n, J = x->J, R = x->R, verdict = OPEN, reason = 0, defined = 1, impossible = -1;
    Py_ssize_t B = report->B;
    double bound = INFINITY, value = INFINITY;
    for (int r = 0; r < R; r++) {
        double steep = 0.0, middle = x->c[r], error = x->s[r];
        for (int i = 0; i < n; i++)
            steep += larger(fabs(x->slope_lo[r * n + i]), fabs(x->slope_hi[r * n + i]));
        steep = steep * (1 + 64 * ULP);
        double ends = ULP * fabs(middle), spread = (error + steep) * (1 + ULP) + ends;
        double high = middle + (spread * (1 + ULP) + ends), low = middle - (spread * (1 + ULP) + ends);
        x->high[r] = high < x->hi[r] ? high : x->hi[r];
        x->low[r] = low > x->lo[r] ? low : x->lo[r];
        if (r < J) {
            defined = defined && error < INFINITY;
            bound = smaller(bound, x->high[r]);
            value = smaller(value, middle - error);
        } else {
            if (impossible < 0 && (x->low[r] > 0 || (form->equation[r] && x->high[r] < 0)))
                impossible = r;
            if (!(middle + error <= 0))
                value = -INFINITY;
        }
    }
    choose_multipliers(x, form->equation, report->shared);
    combine(x);
    if (report->models)
        write_model(form, x, report, at, defined);
    double lagrangian = report->models ? INFINITY : quadratic_bound(x);
    bound = lagrangian < bound ? lagrangian : bound;
    bound = defined ? bound : INFINITY;

    for (int i = 0; i < n; i++) {
        Py_ssize_t end = i * B + at;
        report->left_lower[end] = report->lower[end], report->left_upper[end] = report->upper[end];
        report->cut_lower[end] = report->cut_upper[end] = -2;
        report->centre[end] = centre[i];
        x->e_lo[i] = -1.0, x->e_hi[i] = 1.0;
        x->why_lo[i] = x->why_hi[i] = -2;
    }
    /* Monotonicity. */
    for (int i = report->shared; i < n && defined; i++)
        for (int side = 1; side >= -1; side -= 2) {
            Py_ssize_t end = i * B + at;
            int applies = report->upper[end] > report->lower[end] && verdict == OPEN;
            for (int r = 0; r < R && applies; r++) {
                double low = x->grad_lo[r * n + i], high = x->grad_hi[r * n + i];
                if (r < J)
                    applies = side > 0 ? low > 0 : high < 0;
                else if (form->depends[r * n + i] && !(x->high[r] < 0) && r != impossible)
                    applies = !form->equation[r] && (side > 0 ? high < 0 : low > 0);
            }
            if (!applies)
                continue;
            double whole = side > 0 ? form->high[i] : form->low[i];
            if ((side > 0 ? report->upper[end] : report->lower[end]) != whole)
                verdict = MONOTONE, reason = i;
            else if (side > 0)
                report->left_lower[end] = whole, report->cut_lower[end] = -1;
            else
                report->left_upper[end] = whole, report->cut_upper[end] = -1;
        }
    /* Contraction. */
    for (int r = 0; r < R && defined; r++) {
        if (r < J || form->equation[r])
            reach_expression(x, r, 1.0, r < J ? threshold : 0.0);
        if (r >= J)
            reach_expression(x, r, -1.0, 0.0);
    }
    if (R > 1 && defined)
        reach_quadratic(x, 1.0, x->q_middle, x->qb, x->H, x->qw, x->q_rounding, threshold, 0);
    int emptied = -1;
    for (int i = 0; i < n && defined; i++) {
        Py_ssize_t end = i * B + at;
        double *lo = report->left_lower + end, *hi = report->left_upper + end;
        double worth = WORTH * (*hi - *lo), margin = (fabs(centre[i]) + radius[i]) * (4 * ULP);
        double new_lo = centre[i] + radius[i] * x->e_lo[i] - margin, new_hi = centre[i] + radius[i] * x->e_hi[i] + margin;
        int collapsed = report->cut_lower[end] == -1 || report->cut_upper[end] == -1;
        if (x->why_lo[i] >= 0 && !collapsed && new_lo - *lo > worth)
            *lo = new_lo, report->cut_lower[end] = x->why_lo[i];
        if (x->why_hi[i] >= 0 && !collapsed && *hi - new_hi > worth)
            *hi = new_hi, report->cut_upper[end] = x->why_hi[i];
        if (emptied < 0 && *lo > *hi)
            emptied = i;
    }
    if (emptied >= 0)
        verdict = EMPTIED, reason = emptied;
    if (impossible >= 0)
        verdict = INFEASIBLE, reason = impossible;
    if (bound <= threshold)
        verdict = BOUNDED, reason = 0;
    /* The variable to bisect next. */
    double best = -2.0;
    int split = 0, finite = 1, flat = 1;
    for (int i = 0; i < n; i++) {
        Py_ssize_t end = i * B + at;
        double sum = x->qw[i], width = report->upper[end] - report->lower[end];
        double left = report->left_upper[end] - report->left_lower[end];
        for (int j = 0; j < n; j++)
            sum += fabs(x->H[j * n + i]);
        x->left[i] = (LINEAR * fabs(x->qb[i]) + sum) * (left / (width > 0 ? width : 1.0));
        finite = finite && isfinite(x->left[i]);
        flat = flat && !(x->left[i] > 0);
    }
    for (int i = 0; i < n; i++) {
        double left = report->left_upper[i * B + at] - report->left_lower[i * B + at];
        double score = finite && !flat ? x->left[i] : left / (form->high[i] - form->low[i]);
        score = left > 0 ? score : -1.0;
        if (score > best)
            best = score, split = i;
    }
    report->verdict[at] = verdict, report->reason[at] = reason, report->split[at] = split;
    report->bound[at] = bound, report->value[at] = value;
}

/* ---- Blocks of boxes. ---- */

static double *carve(double **rest, size_t count)
{
    double *part = *rest;
    *rest += count;
    return part;
}

static void examine_range(const Form *form, Report *report, Py_ssize_t begin, Py_ssize_t finish, double threshold,
                          double *memory)
{
    size_t n = (size_t)form->n, R = (size_t)form->expressions;
    Store work = {memory, sizeof(Value) / sizeof(double) + n * LANES}, out = work;
    double *rest = memory;
    carve(&rest, (size_t)form->tape.registers * work.stride);
    out.memory = carve(&rest, (size_t)form->tape.outputs * out.stride);
    Lane *lanes[5];
    for (int i = 0; i < 5; i++)
        lanes[i] = (Lane *)carve(&rest, n * LANES);
    Lane *centre = lanes[0], *radius = lanes[1], *lower = lanes[2], *upper = lanes[3];
    Box x = {.n = form->n, .J = form->functions, .R = form->expressions};
    double **singles[] = {&x.c, &x.p, &x.q, &x.s, &x.lo, &x.hi, &x.weights, &x.size, &x.high, &x.low};
    for (size_t i = 0; i < sizeof singles / sizeof *singles; i++)
        *singles[i] = carve(&rest, R);
    double **rows[] = {&x.a, &x.gb, &x.gp, &x.gq, &x.gs, &x.slope_lo, &x.slope_hi, &x.grad_lo, &x.grad_hi};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        *rows[i] = carve(&rest, R * n);
    double *c, *r, **vectors[] = {&x.left, &x.qb, &x.qw, &x.qlo, &x.qhi, &x.sign, &x.fb, &x.fw, &x.diagonal, &x.t,
                                  &x.gradient, &x.e_lo, &x.e_hi, &c, &r};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++)
        *vectors[i] = carve(&rest, n);
    x.gA = carve(&rest, R * n * n), x.H = carve(&rest, n * n), x.fH = carve(&rest, n * n);
    x.why_lo = (int *)carve(&rest, n), x.why_hi = (int *)carve(&rest, n);
    for (Py_ssize_t start = begin; start < finish; start += LANES) {
        EACH
        {
            Py_ssize_t at = start + l < finish ? start + l : finish - 1;
            for (size_t i = 0; i < n; i++, at += report->B) {
                double lo = report->lower[at], hi = report->upper[at], middle = 0.5 * lo + 0.5 * hi;
                middle = smaller(larger(middle, lo), hi);
                double half = larger(hi - middle, middle - lo);
                lower[i][l] = lo, upper[i][l] = hi, centre[i][l] = middle;
                radius[i][l] = half > 0 ? half * (1 + ULP) + TINY : 0.0;
            }
        }
        run(&form->tape, form->n, work, out, centre, radius, lower, upper, lanes[4]);
        for (int l = 0; l < LANES && start + l < finish; l++) {
            for (size_t i = 0; i < n; i++)
                c[i] = centre[i][l], r[i] = radius[i][l];
            for (size_t k = 0; k < R; k++) {
                Value *v = value_of(out, (int)k);
                x.c[k] = v->c[l], x.p[k] = v->p[l], x.q[k] = v->q[l], x.s[k] = v->s[l];
                x.lo[k] = v->lo[l], x.hi[k] = v->hi[l];
                for (size_t i = 0, at = k * n; i < n; i++, at++) {
                    Value *g = value_of(out, (int)(R + at));
                    int wide = r[i] > 0;
                    x.a[at] = terms_of(v)[i][l];
                    x.gb[at] = wide ? g->c[l] * r[i] : 0.0, x.gs[at] = wide ? g->s[l] * r[i] : 0.0;
                    x.gp[at] = wide ? g->p[l] * r[i] : 0.0, x.gq[at] = wide ? g->q[l] * r[i] : 0.0;
                    x.grad_lo[at] = g->lo[l], x.grad_hi[at] = g->hi[l];
                    x.slope_lo[at] = wide ? g->lo[l] * r[i] : 0.0, x.slope_hi[at] = wide ? g->hi[l] * r[i] : 0.0;
                    for (size_t j = 0; j < n; j++)
                        x.gA[at * n + j] = terms_of(g)[j][l] * r[i];
                }
            }
            judge(form, &x, c, r, report, start + l, threshold);
        }
    }
}

static size_t memory_needed(const Form *form)
{
    size_t n = (size_t)form->n, R = (size_t)form->expressions, stride = sizeof(Value) / sizeof(double) + n * LANES;
    size_t values = (size_t)(form->tape.registers + form->tape.outputs) * stride + 5 * n * LANES;
    return values + 10 * R + 9 * R * n + 17 * n + (R + 2) * n * n;
}

/* ---- Python. ---- */

typedef struct {
    Py_buffer buffers[24];
    int count;
} Borrowed;

/* Memory of an array, which must be contiguous and hold so many items of a size. NULL with an exception otherwise. */
static void *borrow(Borrowed *all, PyObject *object, Py_ssize_t items, Py_ssize_t size, int writable)
{
    Py_buffer *view = &all->buffers[all->count];
    if (PyObject_GetBuffer(object, view, writable ? PyBUF_WRITABLE | PyBUF_C_CONTIGUOUS : PyBUF_C_CONTIGUOUS) < 0)
        return NULL;
    all->count++;
    if (view->len != items * size) {
        PyErr_SetString(PyExc_ValueError, "an array has another size than the kernel expects");
        return NULL;
    }
    return view->buf;
}

static int read_tape(Borrowed *all, PyObject *tuple, Tape *tape)
{
    PyObject *code, *constants;
    if (!PyArg_ParseTuple(tuple, "OOiii", &code, &constants, &tape->length, &tape->registers, &tape->outputs))
        return -1;
    tape->code = borrow(all, code, (Py_ssize_t)tape->length * 6, sizeof(int), 0);
    tape->k = tape->code ? borrow(all, constants, tape->length, sizeof(double), 0) : NULL;
    return tape->k ? 0 : -1;
}

static PyObject *examine(PyObject *module, PyObject *args)
{
    PyObject *tape, *equation, *depends, *low, *high, *arrays[12], *models = NULL;
    Form form = {0};
    Report report = {0};
    Py_ssize_t begin, finish;
    double threshold;
    Borrowed all = {.count = 0};
    (void)module;
    if (!PyArg_ParseTuple(args, "(iiOOOOO!)(OOOOOOOOOOOO)nnnd|iO", &form.n, &form.functions, &equation, &depends, &low,
                          &high, &PyTuple_Type, &tape, &arrays[0], &arrays[1], &arrays[2],
                          &arrays[3], &arrays[4], &arrays[5], &arrays[6], &arrays[7], &arrays[8], &arrays[9],
                          &arrays[10], &arrays[11], &report.B, &begin, &finish, &threshold,
                          &report.shared, &models))
        return NULL;
    int good = form.n > 0 && form.functions > 0 && read_tape(&all, tape, &form.tape) == 0;
    form.expressions = good ? form.tape.outputs / (form.n + 1) : 0;
    Py_ssize_t n = form.n, R = form.expressions, B = report.B, D = sizeof(double), I = sizeof(int);
    good = good && (form.equation = borrow(&all, equation, R, I, 0)) && (form.depends = borrow(&all, depends, R * n, I, 0));
    good = good && (form.low = borrow(&all, low, n, D, 0)) && (form.high = borrow(&all, high, n, D, 0));
    good = good && (report.lower = borrow(&all, arrays[0], n * B, D, 0)) && (report.upper = borrow(&all, arrays[1], n * B, D, 0));
    good = good && (report.verdict = borrow(&all, arrays[2], B, I, 1)) && (report.reason = borrow(&all, arrays[3], B, I, 1));
    good = good && (report.bound = borrow(&all, arrays[4], B, D, 1));
    good = good && (report.left_lower = borrow(&all, arrays[5], n * B, D, 1));
    good = good && (report.left_upper = borrow(&all, arrays[6], n * B, D, 1));
    good = good && (report.cut_lower = borrow(&all, arrays[7], n * B, I, 1));
    good = good && (report.cut_upper = borrow(&all, arrays[8], n * B, I, 1));
    good = good && (report.split = borrow(&all, arrays[9], B, I, 1)) && (report.value = borrow(&all, arrays[10], B, D, 1));
    good = good && (report.centre = borrow(&all, arrays[11], n * B, D, 1));
    if (good && models) {
        int valid = report.shared >= 0 && report.shared <= form.n;
        Py_ssize_t rows = valid ? rows_of_models(form.n, report.shared) : -1;
        good = (report.models = borrow(&all, models, rows * B, D, 1)) != NULL;
    } else if (report.shared != 0) {
        report.shared = 0;
    }
    double *memory = NULL;
    if (good && (form.functions > R || form.tape.outputs != R * (n + 1) || begin < 0 || finish > B)) {
        PyErr_SetString(PyExc_ValueError, "the kernel got parts that do not belong together");
        good = 0;
    }
    if (good && !(memory = malloc(memory_needed(&form) * sizeof(double))))
        PyErr_NoMemory();
    if (memory) {
        Py_BEGIN_ALLOW_THREADS
        examine_range(&form, &report, begin, finish, threshold, memory);
        Py_END_ALLOW_THREADS
    }
    free(memory);
    for (int i = 0; i < all.count; i++)
        PyBuffer_Release(&all.buffers[i]);
    if (!memory)
        return NULL;
    Py_RETURN_NONE;
}

/* Enclosures of a tape's results over the boxes begin <= i < finish of B: enclosure.py. */
typedef struct {
    const double *lower, *upper;  /* (n, B) */
    double *c, *p, *q, *s, *a;    /* (R, B), a: (R, n, B) */
    Py_ssize_t B;
} Enclosed;

static void enclose_all(const Tape *tape, int n, Enclosed *found, double *memory)
{
    Py_ssize_t B = found->B;
    Store work = {memory, sizeof(Value) / sizeof(double) + (size_t)n * LANES}, out = work;
    double *rest = memory;
    carve(&rest, (size_t)tape->registers * work.stride);
    out.memory = carve(&rest, (size_t)tape->outputs * out.stride);
    Lane *lanes[5];
    for (int i = 0; i < 5; i++)
        lanes[i] = (Lane *)carve(&rest, (size_t)n * LANES);
    Lane *centre = lanes[0], *radius = lanes[1], *lower = lanes[2], *upper = lanes[3];
    for (Py_ssize_t start = 0; start < B; start += LANES) {
        EACH
        {
            Py_ssize_t at = start + l < B ? start + l : B - 1;
            for (int i = 0; i < n; i++, at += B) {
                double lo = found->lower[at], hi = found->upper[at], middle = 0.5 * lo + 0.5 * hi;
                middle = smaller(larger(middle, lo), hi);
                double half = larger(hi - middle, middle - lo);
                lower[i][l] = lo, upper[i][l] = hi, centre[i][l] = middle;
                radius[i][l] = half > 0 ? half * (1 + ULP) + TINY : 0.0;
            }
        }
        run(tape, n, work, out, centre, radius, lower, upper, lanes[4]);
        Py_ssize_t lanes_used = B - start < LANES ? B - start : LANES;
        for (int k = 0; k < tape->outputs; k++) {
            Value *v = value_of(out, k);
            size_t at = (size_t)(k * B + start), bytes = (size_t)lanes_used * sizeof(double);
            memcpy(found->c + at, v->c, bytes), memcpy(found->p + at, v->p, bytes);
            memcpy(found->q + at, v->q, bytes), memcpy(found->s + at, v->s, bytes);
            for (int i = 0; i < n; i++)
                memcpy(found->a + ((size_t)k * (size_t)n + (size_t)i) * (size_t)B + start, terms_of(v)[i], bytes);
        }
    }
}

static PyObject *enclose(PyObject *module, PyObject *args)
{
    PyObject *tuple, *arrays[7];
    Tape tape = {0};
    Enclosed found = {0};
    int n;
    Borrowed all = {.count = 0};
    (void)module;
    if (!PyArg_ParseTuple(args, "iO!(OOOOOOO)n", &n, &PyTuple_Type, &tuple, &arrays[0], &arrays[1], &arrays[2],
                          &arrays[3], &arrays[4], &arrays[5], &arrays[6], &found.B))
        return NULL;
    int good = n > 0 && found.B > 0 && read_tape(&all, tuple, &tape) == 0;
    Py_ssize_t R = tape.outputs, B = found.B, D = sizeof(double);
    good = good && (found.lower = borrow(&all, arrays[0], n * B, D, 0)) && (found.upper = borrow(&all, arrays[1], n * B, D, 0));
    good = good && (found.c = borrow(&all, arrays[2], R * B, D, 1)) && (found.p = borrow(&all, arrays[3], R * B, D, 1));
    good = good && (found.q = borrow(&all, arrays[4], R * B, D, 1)) && (found.s = borrow(&all, arrays[5], R * B, D, 1));
    good = good && (found.a = borrow(&all, arrays[6], R * n * B, D, 1));
    double *memory = NULL;
    size_t stride = sizeof(Value) / sizeof(double) + (size_t)(n > 0 ? n : 0) * LANES;
    if (good && !(memory = malloc(((size_t)(tape.registers + tape.outputs) * stride + 5 * (size_t)n * LANES) * sizeof(double))))
        PyErr_NoMemory();
    if (memory) {
        Py_BEGIN_ALLOW_THREADS
        enclose_all(&tape, n, &found, memory);
        Py_END_ALLOW_THREADS
    } else if (!PyErr_Occurred()) {
        PyErr_SetString(PyExc_ValueError, "the kernel got no variables or no boxes");
    }
    free(memory);
    for (int i = 0; i < all.count; i++)
        PyBuffer_Release(&all.buffers[i]);
    if (!memory)
        return NULL;
    Py_RETURN_NONE;
}

static PyMethodDef methods[] = {
    {"enclose", enclose, METH_VARARGS,
     "enclose(n, tape, (lower, upper, c, p, q, s, a), B)\n\n"
     "Write the forms of the results of a tape over B boxes: arrays (n, B), (R, B), and (R, n, B) for a."},
    {"examine", examine, METH_VARARGS,
     "examine((n, functions, equation, depends, low, high, tape), arrays, B, begin, finish, threshold,\n"
     "        shared=0, models=None)\n\n"
     "Examine the boxes begin <= i < finish of B; a tape is (code, constants, length, registers, results).\n"
     "With models the first variables are shared with other limbs."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_bounds", "Bounds over lists of boxes.", -1, methods,
                                    NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__bounds(void) { return PyModule_Create(&module); }
