/* Types of the kernel: tapes, forms, and enclosures over LANES boxes at once.
 * Reference in NumPy: tests/reference/numpy_engine/first_order.py. */
#ifndef VALUES_H
#define VALUES_H

#include <math.h>
#include <stddef.h>
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
#define LARGEST 1e150 /* tests/reference/numpy_engine/intervals.py */
#define TIE 1e-6 /* relative difference of sizes that count as the same: models/arrays.py */

enum { CONSTANT, INPUT, OUTPUT, ADD, SUB, MUL, DIV, SHIFT, SCALE, SQUARE, SQRT, SIN, COS, EXP, LOG, ATAN, RAMP, STEP };

typedef double Lane[LANES];

typedef struct {
    const int *code; /* op, to, a, b, first, last */
    const double *k;
    int length, registers, outputs;
} Tape;

typedef struct {
    int n, functions, expressions; /* R expressions, the functions first, then the conditions */
    const int *equation;      /* (R) 1 if it must be 0, 2 if it has no weight */
    const int *depends;       /* (R, n) whether each expression depends on each variable */
    const double *low, *high; /* (n) ends of the whole box */
    int quotients;       /* terms sign N^2 / D of functions: the rows after the expressions are N and D of each */
    const int *whose;    /* (quotients, 2) function and sign */
    int tangents;        /* terms -N^2 / D of functions that tangents may replace: tangents.h */
    const int *squared;  /* (tangents) function of each; values then has a remaining part of each function, and N and D */
    Tape tape;   /* the rows and their derivatives */
    Tape values; /* the expressions without derivatives, and the rows for tangents; empty if second-order forms are not used */
    Tape objective; /* the functions and their derivatives; empty if all rows are evaluated together */
} Form;

/* Working memory that is given out in parts, all 0 at first; without an address, parts are only counted. */
typedef struct {
    double *at;
    size_t used;
} Room;

static double *carve(Room *room, size_t count)
{
    double *part = room->at ? room->at + room->used : NULL;
    room->used += count;
    return part;
}

#define COUNT(array) (sizeof(array) / sizeof *(array))
#define CARVE(parts, count) for (size_t part = 0; part < COUNT(parts); part++) *parts[part] = carve(room, count)

static inline int rows_of(const Form *form) { return form->expressions + 2 * form->quotients; }
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

#endif
