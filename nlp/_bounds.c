/* The kernel of the search of a whole box: what affine.py and bounding.py do, over lists of boxes.
 *
 * The list of instructions is interpreted over LANES boxes at once, so that an instruction is fetched once for all of
 * them and its loops become vector instructions; what the enclosures say is then read off box by box. Every formula is
 * that of the two Python modules, in the same order; their comments and docs/certificate.md explain them.
 *
 * Rounding is to nearest. Never compile this with -ffast-math: it would drop the NaN tests that keep boxes; nor with
 * contraction to fused operations, which would make the two engines differ.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__)
#define WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define WIDE
#endif

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

enum { CONSTANT, INPUT, OUTPUT, ADD, SUB, MUL, DIV, SHIFT, SCALE, SQUARE, SQRT, SIN, COS, EXP, LOG, ATAN };
enum { OPEN, BOUNDED, INFEASIBLE, MONOTONE, EMPTIED };

typedef double Lane[LANES];

/* An enclosure over LANES boxes: form, interval, and the sum of |a|. The n coefficients follow it in memory. */
typedef struct {
    Lane c, d, lo, hi, rad;
} Value;

typedef struct {
    const int *code; /* op, to, a, b, first, last */
    const double *k;
    int length, registers, outputs;
} Tape;

typedef struct {
    int n, functions, expressions;
    const int *equation;      /* (R) */
    const int *depends;       /* (R, n) */
    const double *low, *high; /* (n) the whole box */
    Tape full, values;
} Form;

typedef struct {
    double *memory;
    size_t stride; /* doubles of a value with its coefficients */
} Store;

static inline Value *value_of(Store s, int i) { return (Value *)(s.memory + (size_t)i * s.stride); }
static inline Lane *terms_of(Value *v) { return (Lane *)(v + 1); }
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

/* ---- Rules for functions of one variable: slope, shift and error on [lo, hi], and the interval of the result. ---- */

typedef struct {
    double slope, shift, off, lo, hi;
} Rule;

static Rule taylor(double lo, double hi, double value, double slope, double least_curved, double most_curved)
{
    double middle = 0.5 * lo + 0.5 * hi, radius = larger(hi - middle, middle - lo) * (1 + ULP) + TINY;
    double half = 0.5 * radius * radius;
    double least = smaller(half * least_curved, 0.0), most = larger(half * most_curved, 0.0);
    double size = fabs(value) + fabs(slope) * (fabs(middle) + radius) + (most - least);
    Rule r = {slope, value - slope * middle + 0.5 * (least + most), 0.5 * (most - least) + 2 * LIBRARY * ULP * size, 0, 0};
    return r;
}

static Rule wave(double lo, double hi, int shifted)
{
    double middle = 0.5 * lo + 0.5 * hi, radius = larger(hi - middle, middle - lo) * (1 + ULP) + TINY;
    double sine = sin(middle), cosine = cos(middle);
    double value = shifted ? cosine : sine, slope = shifted ? -sine : cosine;
    double spread = fabs(slope) * radius + 0.5 * radius * radius;
    spread = spread + (2 * LIBRARY * ULP) * (1 + spread);
    double least = larger(value - spread, -1.0), most = smaller(value + spread, 1.0);
    Rule r = taylor(lo, hi, value, slope, -most, -least);
    r.off = r.off + (2 * LIBRARY * ULP) * (1 + radius);
    r.lo = least, r.hi = most;
    return r;
}

static Rule rule_of(int op, double lo, double hi)
{
    double middle = 0.5 * lo + 0.5 * hi, ends = LIBRARY * ULP;
    Rule r = {NAN, NAN, NAN, NAN, NAN};
    if (op == SQRT) {
        double low = sqrt(lo), high = sqrt(hi);
        double slope = 1.0 / (low + high), least = low * high * slope, most = 0.25 * (low + high);
        r.slope = slope, r.shift = 0.5 * (least + most);
        r.off = larger(0.5 * (most - least), 0.0) + 16 * ULP * high;
        r.lo = low - fabs(low) * ULP, r.hi = high + fabs(high) * ULP;
    } else if (op == SIN || op == COS) {
        r = wave(lo, hi, op == COS);
    } else if (op == EXP) {
        double value = exp(middle);
        double least = larger(exp(lo) * (1 - ends) - TINY, 0.0), most = exp(hi) * (1 + ends) + TINY;
        r = taylor(lo, hi, value, value, least, most);
        r.lo = least, r.hi = most;
    } else if (op == LOG && lo > 0) {
        double low = log(lo), high = log(hi), curved = 1 + ends;
        r = taylor(lo, hi, log(middle), 1 / middle, -curved / (lo * lo), -1 / (curved * hi * hi));
        r.lo = low - (fabs(low) * ends + TINY), r.hi = high + (fabs(high) * ends + TINY);
    } else if (op == ATAN) {
        double low = atan(lo), high = atan(hi);
        double most = lo >= 0 ? 0.0 : smaller(0.65, -2 * lo * (1 + ULP));
        double least = hi <= 0 ? 0.0 : larger(-0.65, -2 * hi * (1 + ULP));
        r = taylor(lo, hi, atan(middle), 1 / (1 + middle * middle), least, most);
        r.lo = low - (fabs(low) * ends + TINY), r.hi = high + (fabs(high) * ends + TINY);
    }
    return r;
}

/* ---- The interpreter. ---- */

typedef struct {
    Lane c, d, lo, hi;
} Result;

static inline __attribute__((always_inline)) void interval_product(const double *lo, const double *hi,
                                                                   const double *other_lo, const double *other_hi,
                                                                   Result *out)
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

/* Write a value: poison what has no finite enclosure, intersect the interval with the form's range. */
static inline __attribute__((always_inline)) void settle(Value *v, int n, int first, int last, double slack,
                                                         const Result *from, Lane *restrict t)
{
    Lane *a = terms_of(v);
    Lane rad;
    EACH rad[l] = 0.0;
    for (int i = first; i < last; i++)
        EACH rad[l] += fabs(t[i][l]);
    if (first > 0)
        memset(a, 0, (size_t)first * sizeof(Lane));
    if (last < n)
        memset(a + last, 0, (size_t)(n - last) * sizeof(Lane));
    int all = 1;
    EACH
    {
        double c = from->c[l], d = from->d[l] * (1 + slack);
        double reach = (rad[l] + d) * (1 + slack);
        double ends = ULP * fabs(c), low = c - (reach + ends), high = c + (reach + ends);
        int good = (reach < INFINITY) & (fabs(c) < INFINITY);
        all &= good;
        v->c[l] = good ? c : 0.0;
        v->d[l] = good ? d : INFINITY;
        v->rad[l] = good ? rad[l] : 0.0;
        double lo = from->lo[l] > low ? from->lo[l] : low, hi = from->hi[l] < high ? from->hi[l] : high;
        v->lo[l] = good ? lo : -INFINITY;
        v->hi[l] = good ? hi : INFINITY;
    }
    memcpy(a + first, t + first, (size_t)(last > first ? last - first : 0) * sizeof(Lane));
    if (!all)
        for (int i = first; i < last; i++)
            EACH a[i][l] = v->d[l] < INFINITY ? a[i][l] : 0.0;
}

WIDE static void run(const Tape *tape, int n, Store work, Store out, Lane *centre, Lane *radius, Lane *lower,
                     Lane *upper, Lane *t)
{
    double slack = (n + 8) * ULP;
    for (int index = 0; index < tape->length; index++) {
        const int *code = tape->code + 6 * index;
        int op = code[0], first = n ? code[4] : 0, last = n ? code[5] : 0;
        double k = tape->k[index];
        Value *v = value_of(op == OUTPUT ? out : work, code[1]);
        Value *x = value_of(work, op == INPUT ? 0 : code[2]), *y = value_of(work, op == INPUT ? 0 : code[3]);
        Lane *a = terms_of(v), *ax = terms_of(x), *ay = terms_of(y);
        Result r;
        switch (op) {
        case OUTPUT:
            memcpy(v, x, sizeof(Value) + (size_t)n * sizeof(Lane));
            continue;
        case INPUT:
            memset(v, 0, sizeof(Value) + (size_t)n * sizeof(Lane));
            memcpy(v->c, centre[code[2]], sizeof(Lane));
            memcpy(v->lo, lower[code[2]], sizeof(Lane));
            memcpy(v->hi, upper[code[2]], sizeof(Lane));
            if (n) {
                memcpy(a[code[2]], radius[code[2]], sizeof(Lane));
                memcpy(v->rad, radius[code[2]], sizeof(Lane));
            }
            continue;
        case CONSTANT:
            memset(v, 0, sizeof(Value) + (size_t)n * sizeof(Lane));
            EACH v->c[l] = v->lo[l] = v->hi[l] = k;
            continue;
        case ADD:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l] + ay[i][l];
            EACH
            {
                double c = x->c[l] + y->c[l], lo = x->lo[l] + y->lo[l], hi = x->hi[l] + y->hi[l];
                r.c[l] = c, r.lo[l] = lo - fabs(lo) * ULP, r.hi[l] = hi + fabs(hi) * ULP;
                r.d[l] = x->d[l] + y->d[l] + slack * (fabs(c) + x->rad[l] + y->rad[l]);
            }
            break;
        case SUB:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l] - ay[i][l];
            EACH
            {
                double c = x->c[l] - y->c[l], lo = x->lo[l] - y->hi[l], hi = x->hi[l] - y->lo[l];
                r.c[l] = c, r.lo[l] = lo - fabs(lo) * ULP, r.hi[l] = hi + fabs(hi) * ULP;
                r.d[l] = x->d[l] + y->d[l] + slack * (fabs(c) + x->rad[l] + y->rad[l]);
            }
            break;
        case SHIFT:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l];
            EACH
            {
                double c = x->c[l] + k, lo = x->lo[l] + k, hi = x->hi[l] + k;
                r.c[l] = c, r.lo[l] = lo - fabs(lo) * ULP, r.hi[l] = hi + fabs(hi) * ULP;
                r.d[l] = x->d[l] + slack * fabs(c);
            }
            break;
        case SCALE:
            for (int i = first; i < last; i++)
                EACH t[i][l] = ax[i][l] * k;
            EACH
            {
                double c = x->c[l] * k, one = x->lo[l] * k, other = x->hi[l] * k, size = fabs(k);
                double lo = k >= 0 ? one : other, hi = k >= 0 ? other : one;
                double off = slack * (fabs(c) + size * x->rad[l]) + TINY;
                int exact = size == 1;
                r.c[l] = c, r.d[l] = exact ? x->d[l] : x->d[l] * size + off;
                r.lo[l] = exact ? lo : lo - (fabs(lo) * ULP + TINY);
                r.hi[l] = exact ? hi : hi + (fabs(hi) * ULP + TINY);
            }
            break;
        case MUL: {
            Lane sum, size;
            EACH sum[l] = size[l] = 0.0;
            for (int i = first; i < last; i++)
                EACH
                {
                    double product = ax[i][l] * ay[i][l];
                    sum[l] += product, size[l] += fabs(product);
                    t[i][l] = x->c[l] * ay[i][l] + y->c[l] * ax[i][l];
                }
            EACH
            {
                double px = fabs(x->c[l]), py = fabs(y->c[l]);
                double rx = x->rad[l] + x->d[l], ry = y->rad[l] + y->d[l];
                r.c[l] = x->c[l] * y->c[l] + 0.5 * sum[l];
                double d = px * y->d[l] + py * x->d[l] + (rx * ry - 0.5 * size[l]);
                r.d[l] = d + (slack * ((px + rx) * (py + ry)) + TINY);
            }
            interval_product(x->lo, x->hi, y->lo, y->hi, &r);
            break;
        }
        case SQUARE: {
            Lane sum;
            EACH sum[l] = 0.0;
            for (int i = first; i < last; i++)
                EACH
                {
                    sum[l] += ax[i][l] * ax[i][l];
                    t[i][l] = 2 * x->c[l] * ax[i][l];
                }
            EACH
            {
                double half = 0.5 * sum[l], px = fabs(x->c[l]), rx = x->rad[l] + x->d[l];
                r.c[l] = x->c[l] * x->c[l] + half;
                r.d[l] = 2 * px * x->d[l] + (rx * rx - half) + (slack * ((px + rx) * (px + rx)) + TINY);
                double one = fabs(x->lo[l]), other = fabs(x->hi[l]);
                double small = one < other ? one : other, large = one < other ? other : one;
                small = (x->lo[l] <= 0) & (x->hi[l] >= 0) ? 0.0 : small;
                double lo = small * small, hi = large * large;
                lo = lo - (lo * ULP + TINY);
                r.lo[l] = lo > 0.0 ? lo : 0.0;
                r.hi[l] = hi + (hi * ULP + TINY);
            }
            break;
        }
        case DIV: {
            Lane ci, pi, ri, di, q, dn, rn, ra, size, sum, slope, low, high;
            EACH
            {
                double sign = y->lo[l] > 0 ? 1.0 : -1.0;
                double near = y->lo[l] > 0 ? y->lo[l] : -y->hi[l], far = y->lo[l] > 0 ? y->hi[l] : -y->lo[l];
                near = near > 0 ? near : NAN;
                double product = near * far, most = 1.0 / near + 1.0 / far, least = 2.0 / sqrt(product);
                slope[l] = -1.0 / product;
                double steep = fabs(slope[l]), shift = 0.5 * (least + most), half = 0.5 * (most - least);
                double off = (half > 0.0 ? half : 0.0) + 16 * ULP * most;
                ci[l] = slope[l] * y->c[l] + sign * shift;
                pi[l] = steep * fabs(y->c[l]) + shift, ri[l] = steep * y->rad[l];
                di[l] = steep * y->d[l] + off + (slack * (pi[l] + ri[l]) + TINY);
                q[l] = x->c[l] / y->c[l];
                double whole = fabs(x->c[l]) + x->rad[l] + fabs(q[l]) * (fabs(y->c[l]) + y->rad[l]);
                dn[l] = x->d[l] + fabs(q[l]) * y->d[l] + (slack * whole + TINY);
                double one = sign / far, other = sign / near;
                double least_inverse = one < other ? one : other, most_inverse = one < other ? other : one;
                low[l] = least_inverse - (fabs(least_inverse) * ULP + TINY);
                high[l] = most_inverse + (fabs(most_inverse) * ULP + TINY);
                ra[l] = sum[l] = size[l] = 0.0;
            }
            for (int i = first; i < last; i++)
                EACH
                {
                    double an = ax[i][l] - q[l] * ay[i][l], product = an * (slope[l] * ay[i][l]);
                    ra[l] += fabs(an), sum[l] += product, size[l] += fabs(product);
                    t[i][l] = ci[l] * an;
                }
            EACH
            {
                rn[l] = ra[l] * (1 + slack) + dn[l], ri[l] = ri[l] * (1 + slack) + di[l];
                r.c[l] = q[l] + 0.5 * sum[l];
                double d = fabs(ci[l]) * dn[l] + (rn[l] * ri[l] - 0.5 * size[l]);
                r.d[l] = d + (slack * (fabs(q[l]) + (fabs(ci[l]) + ri[l]) * rn[l]) + TINY);
            }
            interval_product(x->lo, x->hi, low, high, &r);
            break;
        }
        default: {
            Lane slope;
            EACH
            {
                Rule rule = rule_of(op, x->lo[l], x->hi[l]);
                double steep = fabs(rule.slope);
                double size = steep * (fabs(x->c[l]) + x->rad[l] + x->d[l]) + fabs(rule.shift) + rule.off;
                slope[l] = rule.slope;
                r.c[l] = rule.slope * x->c[l] + rule.shift, r.lo[l] = rule.lo, r.hi[l] = rule.hi;
                r.d[l] = steep * x->d[l] + rule.off + (slack * size + TINY);
            }
            for (int i = first; i < last; i++)
                EACH t[i][l] = slope[l] * ax[i][l];
        }
        }
        settle(v, n, first, last, slack, &r, t);
    }
}

/* ---- What the enclosures say about one box. ---- */

/* The expressions over one box, and an upper model middle + b e + 1/2 e'He + w |e| of a combination of them. */
typedef struct {
    int n, J, R;
    double *middle, *error;       /* (R) at the centre */
    double *c, *d, *lo, *hi, *a;  /* (R), a: (R, n): forms of the expressions */
    double *b, *A, *w;            /* (R, n), (R, n, n), (R, n): of their scaled gradients */
    double *slope_lo, *slope_hi;  /* (R, n) scaled */
    double *grad_lo, *grad_hi;    /* (R, n) */
    double *weights, *size, *left, *high, *low; /* (R), (R), (n), (R), (R) */
    double *qb, *qw, *qlo, *qhi, *H;            /* the Lagrangian's model */
    double *s, *fb, *fw, *fH, *diagonal, *t, *gradient; /* (n), fH: (n, n) */
    double *e_lo, *e_hi;
    int *why_lo, *why_hi;
    double q_middle, q_rounding;
} Box;

static void choose_multipliers(Box *x, const int *equation)
{
    int n = x->n, J = x->J, R = x->R;
    for (int r = 0; r < R; r++) {
        x->weights[r] = r == 0;
        x->size[r] = 0.0;
        for (int i = 0; i < n; i++) {
            double along = x->b[r * n + i] - (r < J ? x->b[i] : 0.0);
            x->size[r] += along * along;
        }
    }
    memcpy(x->left, x->b, (size_t)n * sizeof(double));
    for (int round = 0; round < (R > 1 ? MULTIPLIER_ROUNDS : 0); round++)
        for (int r = 1; r < R; r++) {
            if (!(x->size[r] > 0 && x->size[r] < INFINITY && (r < J || x->high[r] >= 0)))
                continue;
            double product = 0.0, weight = x->weights[r];
            for (int i = 0; i < n; i++)
                product += (x->b[r * n + i] - (r < J ? x->b[i] : 0.0)) * x->left[i];
            double new = weight - product / x->size[r];
            if (r < J)
                new = smaller(larger(new, 0.0), weight + x->weights[0]);
            else if (!equation[r])
                new = smaller(new, 0.0);
            if (!isfinite(new))
                continue;
            double change = new - weight;
            for (int i = 0; i < n; i++)
                x->left[i] += change * (x->b[r * n + i] - (r < J ? x->b[i] : 0.0));
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

static void combine(Box *x)
{
    int n = x->n, R = x->R;
    double largest = 0.0, sums = 0.0;
    x->q_middle = 0.0;
    for (int r = 0; r < R; r++)
        if (x->weights[r] != 0) {
            double size = fabs(x->weights[r]);
            x->q_middle += x->middle[r] * x->weights[r] + x->error[r] * size;
            largest += fabs(x->middle[r]) * size;
        }
    for (int i = 0; i < n; i++) {
        double b = 0.0, w = 0.0, low = 0.0, high = 0.0, reach = 0.0;
        double *H = x->H + i * n;
        memset(H, 0, (size_t)n * sizeof(double));
        for (int r = 0; r < R; r++) {
            double weight = x->weights[r];
            if (weight == 0)
                continue;
            int at = r * n + i;
            b += x->b[at] * weight, w += x->w[at] * fabs(weight);
            low += (weight > 0 ? x->slope_lo[at] : x->slope_hi[at]) * weight;
            high += (weight > 0 ? x->slope_hi[at] : x->slope_lo[at]) * weight;
            for (int j = 0; j < n; j++)
                H[j] += x->A[at * n + j] * weight;
        }
        for (int j = 0; j < n; j++)
            reach += fabs(H[j]);
        reach += w;
        double margin = 64 * ULP * (fabs(b) + reach) + TINY;
        low = low > b - reach || isnan(b - reach) ? low : b - reach;
        high = high < b + reach || isnan(b + reach) ? high : b + reach;
        x->qb[i] = b, x->qw[i] = w, x->qlo[i] = low - margin, x->qhi[i] = high + margin;
        sums += fabs(b) + 2 * reach;
    }
    x->q_rounding = 64 * ULP * (largest + sums) + TINY;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            x->H[i * n + j] = x->H[j * n + i] = 0.5 * (x->H[i * n + j] + x->H[j * n + i]);
}

/* Largest of linear t + 1/2 quadratic t^2 for t in [0, 1], linear not negative. */
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
        x->s[i] = x->qlo[i] >= 0 ? 1.0 : x->qhi[i] <= 0 ? -1.0 : 0.0;
    }
    for (int i = 0; i < n; i++) {
        double Hs = 0.0;
        for (int j = 0; j < n; j++)
            Hs += x->H[i * n + j] * x->s[j];
        fixed += x->qb[i] * x->s[i] + 0.5 * (x->s[i] * Hs) + x->qw[i] * fabs(x->s[i]);
        x->fb[i] = x->s[i] == 0 ? x->qb[i] + Hs : 0.0;
        x->fw[i] = x->s[i] == 0 ? x->qw[i] : 0.0;
    }
    for (int i = 0; i < n; i++) {
        double others = 0.0;
        for (int j = 0; j < n; j++) {
            x->fH[i * n + j] = x->s[i] == 0 && x->s[j] == 0 ? x->H[i * n + j] : 0.0;
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

/* First and last t in [0, 1] with linear t + 1/2 quadratic t^2 >= need; last < first where there is none. */
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

/* Bounds on the e_i for which sign times a model reaches a level. H is (n, n); for an expression not yet symmetric. */
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
        double diagonal = sign * H[i * n + i], linear = sign * b[i], need = level - (total - x->t[i]);
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
    double rad = 0.0;
    for (int i = 0; i < n; i++)
        rad += fabs(a[i]);
    double slack = x->d[r] + (fabs(x->c[r]) + rad + fabs(level)) * (64 * ULP) + TINY;
    for (int i = 0; i < n; i++) {
        double along = sign * a[i], needed = (level - sign * x->c[r] - slack - (rad - fabs(along))) / along;
        double margin = fabs(needed) * (8 * ULP);
        keep(x, i, along > 0 && needed > -1 ? needed - margin : -1.0, along < 0 && needed < 1 ? needed + margin : 1.0, r);
    }
}

static void reach_expression(Box *x, int r, double sign, double level)
{
    int n = x->n;
    const double *b = x->b + r * n, *A = x->A + r * n * n, *w = x->w + r * n;
    double sums = 0.0;
    reach_affine(x, r, sign, level);
    for (int i = 0; i < n; i++) {
        double reach = w[i];
        for (int j = 0; j < n; j++)
            reach += fabs(A[i * n + j]);
        sums += fabs(b[i]) + 2 * reach;
    }
    reach_quadratic(x, sign, sign * x->middle[r] + x->error[r], b, A, w,
                    64 * ULP * (fabs(x->middle[r]) + sums) + TINY, level, r);
}

/* Where the results go, for B boxes; the ends and reasons of variable i are at i * B. */
typedef struct {
    Py_ssize_t B;
    const double *lower, *upper;
    int *verdict, *reason, *split, *cut_lower, *cut_upper;
    double *bound, *value, *left_lower, *left_upper, *centre;
} Report;

static void judge(const Form *form, Box *x, const double *centre, const double *radius, Report *report, Py_ssize_t at,
                  double threshold)
{
    int n = x->n, J = x->J, R = x->R, verdict = OPEN, reason = 0, defined = 1, impossible = -1;
    Py_ssize_t B = report->B;
    double bound = INFINITY, value = INFINITY;
    for (int r = 0; r < R; r++) {
        double steep = 0.0, middle = x->middle[r];
        for (int i = 0; i < n; i++)
            steep += larger(fabs(x->slope_lo[r * n + i]), fabs(x->slope_hi[r * n + i]));
        steep = steep * (1 + 64 * ULP);
        double spread = (x->error[r] + steep) * (1 + ULP), ends = ULP * fabs(middle);
        double high = middle + spread + ends, low = middle - spread - ends;
        x->high[r] = high < x->hi[r] ? high : x->hi[r];
        x->low[r] = low > x->lo[r] ? low : x->lo[r];
        if (r < J) {
            defined = defined && x->d[r] < INFINITY;
            bound = smaller(bound, x->high[r]);
            value = smaller(value, middle - x->error[r]);
        } else {
            if (impossible < 0 && (x->low[r] > 0 || (form->equation[r] && x->high[r] < 0)))
                impossible = r;
            if (!(middle + x->error[r] <= 0))
                value = -INFINITY;
        }
    }
    choose_multipliers(x, form->equation);
    combine(x);
    double lagrangian = quadratic_bound(x);
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
    /* Monotone directions. */
    for (int i = 0; i < n && defined; i++)
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
    /* The variable to cut. */
    double best = -2.0;
    int split = 0, finite = 1, flat = 1;
    for (int i = 0; i < n; i++) {
        Py_ssize_t end = i * B + at;
        double sum = x->qw[i], width = report->upper[end] - report->lower[end];
        double left = report->left_upper[end] - report->left_lower[end];
        for (int j = 0; j < n; j++)
            sum += fabs(x->H[j * n + i]);
        x->s[i] = (LINEAR * fabs(x->qb[i]) + sum) * (left / (width > 0 ? width : 1.0));
        finite = finite && isfinite(x->s[i]);
        flat = flat && !(x->s[i] > 0);
    }
    for (int i = 0; i < n; i++) {
        double left = report->left_upper[i * B + at] - report->left_lower[i * B + at];
        double score = finite && !flat ? x->s[i] : left / (form->high[i] - form->low[i]);
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
    size_t n = (size_t)form->n, R = (size_t)form->expressions, head = sizeof(Value) / sizeof(double);
    Store work = {0}, out = {0}, point = {0};
    work.stride = out.stride = head + n * LANES, point.stride = head;
    double *rest = memory;
    work.memory = carve(&rest, (size_t)form->full.registers * work.stride);
    out.memory = carve(&rest, (size_t)form->full.outputs * out.stride);
    Store point_work = {carve(&rest, (size_t)form->values.registers * head), head};
    point.memory = carve(&rest, R * head);
    Lane *centre = (Lane *)carve(&rest, n * LANES), *radius = (Lane *)carve(&rest, n * LANES);
    Lane *lower = (Lane *)carve(&rest, n * LANES), *upper = (Lane *)carve(&rest, n * LANES);
    Lane *t = (Lane *)carve(&rest, n * LANES);
    Box x = {.n = form->n, .J = form->functions, .R = form->expressions};
    double **singles[] = {&x.middle, &x.error, &x.c, &x.d, &x.lo, &x.hi, &x.weights, &x.size, &x.high, &x.low};
    for (size_t i = 0; i < sizeof singles / sizeof *singles; i++)
        *singles[i] = carve(&rest, R);
    double **rows[] = {&x.a, &x.b, &x.w, &x.slope_lo, &x.slope_hi, &x.grad_lo, &x.grad_hi};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        *rows[i] = carve(&rest, R * n);
    double **vectors[] = {&x.left, &x.qb, &x.qw, &x.qlo, &x.qhi, &x.s, &x.fb, &x.fw, &x.diagonal, &x.t, &x.gradient, &x.e_lo, &x.e_hi};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++)
        *vectors[i] = carve(&rest, n);
    x.A = carve(&rest, R * n * n), x.H = carve(&rest, n * n), x.fH = carve(&rest, n * n);
    x.why_lo = (int *)carve(&rest, n), x.why_hi = (int *)carve(&rest, n);
    double *c = carve(&rest, n), *r = carve(&rest, n);
    for (Py_ssize_t start = begin; start < finish; start += LANES) {
        EACH
        {
            Py_ssize_t at = start + l < finish ? start + l : finish - 1;
            for (size_t i = 0; i < n; i++) {
                double lo = report->lower[(Py_ssize_t)i * report->B + at], hi = report->upper[(Py_ssize_t)i * report->B + at];
                double middle = smaller(larger(0.5 * lo + 0.5 * hi, lo), hi), half = larger(hi - middle, middle - lo);
                lower[i][l] = lo, upper[i][l] = hi, centre[i][l] = middle;
                radius[i][l] = half > 0 ? half * (1 + ULP) + TINY : 0.0;
            }
        }
        run(&form->full, form->n, work, out, centre, radius, lower, upper, t);
        run(&form->values, 0, point_work, point, centre, radius, centre, centre, t);
        for (int l = 0; l < LANES && start + l < finish; l++) {
            for (size_t i = 0; i < n; i++)
                c[i] = centre[i][l], r[i] = radius[i][l];
            for (size_t k = 0; k < R; k++) {
                Value *v = value_of(out, (int)k), *p = value_of(point, (int)k);
                x.middle[k] = p->c[l], x.error[k] = p->d[l];
                x.c[k] = v->c[l], x.d[k] = v->d[l], x.lo[k] = v->lo[l], x.hi[k] = v->hi[l];
                for (size_t i = 0; i < n; i++) {
                    Value *g = value_of(out, (int)(R + k * n + i));
                    size_t at = k * n + i;
                    int wide = r[i] > 0;
                    x.a[at] = terms_of(v)[i][l];
                    x.b[at] = g->c[l] * r[i];
                    x.w[at] = wide ? g->d[l] * r[i] : 0.0;
                    x.grad_lo[at] = g->lo[l], x.grad_hi[at] = g->hi[l];
                    x.slope_lo[at] = wide ? g->lo[l] * r[i] : 0.0, x.slope_hi[at] = wide ? g->hi[l] * r[i] : 0.0;
                    for (size_t j = 0; j < n; j++)
                        x.A[at * n + j] = terms_of(g)[j][l] * r[i];
                }
            }
            judge(form, &x, c, r, report, start + l, threshold);
        }
    }
}

static size_t memory_needed(const Form *form)
{
    size_t n = (size_t)form->n, R = (size_t)form->expressions, head = sizeof(Value) / sizeof(double);
    size_t values = (size_t)(form->full.registers + form->full.outputs) * (head + n * LANES);
    values += ((size_t)form->values.registers + R) * head + 5 * n * LANES;
    return values + 10 * R + 7 * R * n + 17 * n + (R + 2) * n * n + 64;
}

/* ---- Python. ---- */

typedef struct {
    Py_buffer buffers[24];
    int count;
} Borrowed;

/* The memory of an array, which must be contiguous and hold so many items of a size. */
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
    PyObject *full, *values, *equation, *depends, *low, *high, *arrays[12];
    Form form = {0};
    Report report = {0};
    Py_ssize_t begin, finish;
    double threshold;
    Borrowed all = {.count = 0};
    (void)module;
    if (!PyArg_ParseTuple(args, "(iiOOOOO!O!)(OOOOOOOOOOOO)nnnd", &form.n, &form.functions, &equation, &depends, &low,
                          &high, &PyTuple_Type, &full, &PyTuple_Type, &values, &arrays[0], &arrays[1], &arrays[2],
                          &arrays[3], &arrays[4], &arrays[5], &arrays[6], &arrays[7], &arrays[8], &arrays[9],
                          &arrays[10], &arrays[11], &report.B, &begin, &finish, &threshold))
        return NULL;
    int good = read_tape(&all, full, &form.full) == 0 && read_tape(&all, values, &form.values) == 0;
    form.expressions = form.values.outputs;
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
    double *memory = NULL;
    if (good && (n < 1 || form.functions < 1 || form.full.outputs != R * (n + 1) || begin < 0 || finish > B)) {
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

static PyMethodDef methods[] = {
    {"examine", examine, METH_VARARGS,
     "examine((n, functions, equation, depends, low, high, full, values), arrays, B, begin, finish, threshold)\n\n"
     "Examine the boxes begin <= i < finish of B; a tape is (code, constants, length, registers, results)."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_bounds", "Bounds over lists of boxes.", -1, methods,
                                    NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__bounds(void) { return PyModule_Create(&module); }
