/* Mathematics of a WebAssembly module: instructions of the engine, and functions of JavaScript's Math as imports. */
#ifndef SCREWSYNTH_MATHH
#define SCREWSYNTH_MATHH

#define HUGE_VAL __builtin_huge_val()
#define INFINITY __builtin_inff()
#define NAN __builtin_nanf("")
#define isnan(x) __builtin_isnan(x)
#define isinf(x) __builtin_isinf(x)
#define isfinite(x) __builtin_isfinite(x)

#define IMPORTED(name) __attribute__((import_module("Math"), import_name(#name))) double name
IMPORTED(sin)(double);
IMPORTED(cos)(double);
IMPORTED(tan)(double);
IMPORTED(asin)(double);
IMPORTED(acos)(double);
IMPORTED(atan)(double);
IMPORTED(atan2)(double, double);
IMPORTED(sinh)(double);
IMPORTED(cosh)(double);
IMPORTED(tanh)(double);
IMPORTED(asinh)(double);
IMPORTED(acosh)(double);
IMPORTED(atanh)(double);
IMPORTED(exp)(double);
IMPORTED(expm1)(double);
IMPORTED(log)(double);
IMPORTED(log1p)(double);
IMPORTED(pow)(double, double);
IMPORTED(hypot)(double, double);
#undef IMPORTED

static inline double sqrt(double x) { return __builtin_sqrt(x); }
static inline double fabs(double x) { return __builtin_fabs(x); }
static inline double floor(double x) { return __builtin_floor(x); }
static inline double ceil(double x) { return __builtin_ceil(x); }
static inline double trunc(double x) { return __builtin_trunc(x); }
static inline double copysign(double x, double y) { return __builtin_copysign(x, y); }
static inline double fmin(double x, double y) { return x != x ? y : y < x ? y : x; }
static inline double fmax(double x, double y) { return x != x ? y : y > x ? y : x; }
static inline double fmod(double x, double y) { return x - y * trunc(x / y); }

#endif
