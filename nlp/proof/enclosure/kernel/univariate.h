/* Functions of one variable: f(c) + f'(c) Y + [least, most] Y^2, half the second derivative at c, and ranges.
 * Reference in NumPy: tests/reference/numpy_engine/univariate.py. */
#ifndef UNIVARIATE_H
#define UNIVARIATE_H

#include "values.h"

typedef struct {
    double value, slope, curve, least, most, error, slope_error, lo, hi;
} Rule;

#define LIBRARY 8.0
#define OFF (LIBRARY * ULP)

static Rule wave(double c, double lo, double hi, int shifted)
{
    double middle = 0.5 * lo + 0.5 * hi, radius = larger(hi - middle, middle - lo) * (1 + ULP) + TINY;
    double centred = shifted ? cos(middle) : sin(middle), steep = fabs(shifted ? sin(middle) : cos(middle));
    double spread = steep * radius + 0.5 * radius * radius;
    spread = spread + 2 * OFF * (1 + spread);
    double least = larger(centred - spread, -1.0), most = smaller(centred + spread, 1.0);
    double sine = sin(c), cosine = cos(c);
    double value = shifted ? cosine : sine;
    Rule r = {value, shifted ? -sine : cosine, -0.5 * value, -0.5 * most, -0.5 * least, 4 * OFF, 4 * OFF, least, most};
    return r;
}

static Rule rule_of(int op, double c, double lo, double hi)
{
    Rule r = {NAN, NAN, 0.0, NAN, NAN, NAN, 0.0, NAN, NAN};
    lo = smaller(lo, c), hi = larger(hi, c);
    if (op == SQRT && lo >= 0) { /* below 0 all results stay NaN: smaller and larger would drop a NaN of least */
        double root = sqrt(c), low = sqrt(lo), high = sqrt(hi), slope = 0.5 / root;
        r.value = root, r.slope = slope, r.curve = -0.25 * slope / c, r.error = OFF * root;
        r.least = -slope / ((low + root) * (low + root)), r.most = -slope / ((high + root) * (high + root));
        r.lo = low - fabs(low) * ULP, r.hi = high + fabs(high) * ULP;
    } else if (op == SIN || op == COS) {
        r = wave(c, lo, hi, op == COS);
    } else if (op == EXP) {
        r.value = r.slope = exp(c), r.error = r.slope_error = 2 * OFF * r.value;
        r.lo = larger(exp(lo) * (1 - OFF) - TINY, 0.0), r.hi = exp(hi) * (1 + OFF) + TINY;
        r.curve = 0.5 * r.value, r.least = 0.5 * r.lo, r.most = 0.5 * r.hi;
    } else if (op == LOG && lo > 0) {
        double low = log(lo), high = log(hi), grown = 1 + OFF;
        r.value = log(c), r.slope = 1 / c, r.curve = -0.5 * r.slope * r.slope, r.error = 2 * OFF * fabs(r.value);
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
        r.value = atan(c), r.slope = 1 / (1 + c * c), r.curve = -c * r.slope * r.slope, r.error = r.slope_error = 2 * OFF * (fabs(r.value) + 1);
        r.most = lo >= 0 ? 0.0 : smaller(0.325, -lo * (1 + ULP));
        r.least = hi <= 0 ? 0.0 : larger(-0.325, -hi * (1 + ULP));
        r.lo = low - (fabs(low) * OFF + TINY), r.hi = high + (fabs(high) * OFF + TINY);
    }
    return r;
}

#endif
