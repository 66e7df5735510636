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
#define TIE 1e-6 /* part by which sizes may differ and count as the same: models/arrays.py */

enum { CONSTANT, INPUT, OUTPUT, ADD, SUB, MUL, DIV, SHIFT, SCALE, SQUARE, SQRT, SIN, COS, EXP, LOG, ATAN, RAMP, STEP };

typedef double Lane[LANES];

typedef struct {
    const int *code; /* op, to, a, b, first, last */
    const double *k;
    int length, registers, outputs;
} Tape;

typedef struct {
    int n, functions, expressions; /* R expressions, the functions first, then the conditions */
    const int *equation;      /* (R) 1 where it must be 0, 2 where it has no weight */
    const int *depends;       /* (R, n) whether it depends on a variable */
    const double *low, *high; /* (n) ends of the whole box */
    int quotients;       /* terms sign N^2 / D of functions: the rows after the expressions are N and D of each */
    const int *whose;    /* (quotients, 2) function and sign */
    int tangents;        /* terms -N^2 / D of functions that tangents may replace: tangents.h */
    const int *squared;  /* (tangents) function of each; the values have a rest of each function and N and D behind */
    Tape tape;   /* the rows and their derivatives */
    Tape values; /* the expressions alone, and the rows for tangents; without instructions where forms of second order are not used */
    Tape objective; /* the functions and their derivatives; without instructions where all are evaluated at once */
} Form;

/* Memory that is laid out in parts, all 0 at first; without an address they are counted only. */
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
