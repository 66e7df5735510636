/* The rank of a matrix over boxes, from forms of its entries.
 * Reference in NumPy: tests/reference/numpy_engine/rank_rule.py. */
#ifndef RANK_H
#define RANK_H

#include <Python.h>
#include "values.h"

/* Rounding error of a computed sum of products, relative to the sum of the absolute values of all terms: fewer than 900
 * roundings, including those of the middles. A sum has about as many roundings as the matrix has rows. */
#define PRODUCTS 1e-13
#define MOST_ROWS 800
#define RANK_POWERS 12

typedef struct {
    int rows, columns, entries;
    const int *at;       /* (entries, 2) row and column of each entry */
    const double *scale; /* (entries) powers of two */
} Matrix;

/* Forms of the entries: middle + terms e + [-rest, rest]. Coordinates come first, joint-centre errors last: three for each
 * centre, a vector of norm at most 1. C is a left inverse of the scaled matrix of middles M0, NaN without one; off is a
 * bound of |I - C M0|. */
typedef struct {
    int terms, coordinates, errors;
    const double *inverse, *off;  /* (B, columns, rows), (B, columns, columns) */
    const double *a, *rest;       /* (entries, terms, B), (entries, B) */
    int *regular;                 /* (B) */
    double *shares;               /* (coordinates, B) */
    Py_ssize_t B;
} Ranks;

/* Working memory for LANES boxes, and for one of them. */
typedef struct {
    Lane *C, *bound, *linear, *row, *squares, *rest, *size, *terms;
    int *is_term; /* (entries, terms) whether a term differs from 0 in one of the boxes */
    double *B, *v, *w;
} RankParts;

/* Returns whether a positive vector proves that the spectral radius of a nonnegative matrix (c, c) is below 1; writes the
 * vector. */
static int is_contracting(const double *B, int c, double *v, double *w)
{
    for (int i = 0; i < c; i++)
        v[i] = 1;
    for (int step = 0; step < RANK_POWERS; step++) {
        double least = INFINITY, most = 0, largest = 0;
        for (int i = 0; i < c; i++) {
            w[i] = 0;
            for (int j = 0; j < c; j++)
                w[i] += B[i * c + j] * v[j];
            double ratio = w[i] / v[i];
            if (!(ratio < INFINITY))
                return 0;
            least = smaller(least, ratio), most = larger(most, ratio), largest = larger(largest, w[i]);
        }
        if (most < 1 - PRODUCTS)
            return 1;
        if (least >= 1)
            return 0;
        for (int i = 0; i < c; i++)
            v[i] = w[i] / larger(largest, 1e-300) + 1e-9 * v[i];
    }
    return 0;
}

static RankParts lay_parts(const Matrix *m, const Ranks *found, Room *room)
{
    size_t c = (size_t)m->columns, E = (size_t)m->entries, T = (size_t)found->terms;
    RankParts x;
    x.C = (Lane *)carve(room, c * (size_t)m->rows * LANES), x.bound = (Lane *)carve(room, c * c * LANES);
    x.linear = (Lane *)carve(room, (size_t)found->coordinates * c * c * LANES);
    x.row = (Lane *)carve(room, c * LANES), x.squares = (Lane *)carve(room, c * LANES);
    x.rest = (Lane *)carve(room, E * LANES), x.size = (Lane *)carve(room, E * LANES);
    x.terms = (Lane *)carve(room, E * T * LANES), x.is_term = (int *)carve(room, E * T);
    x.B = carve(room, c * c), x.v = carve(room, c), x.w = carve(room, c);
    return x;
}

/* Reads boxes from index start on: inverses and bounds at their middles, scaled forms, and absolute sums of their terms. */
WIDE static void read_forms(const Matrix *m, const Ranks *found, Py_ssize_t start, RankParts x)
{
    Py_ssize_t B = found->B, count = B - start < LANES ? B - start : LANES, c = m->columns, places = c * m->rows;
    for (Py_ssize_t l = 0; l < count; l++) {
        for (Py_ssize_t k = 0; k < places; k++)
            x.C[k][l] = found->inverse[(start + l) * places + k];
        for (Py_ssize_t k = 0; k < c * c; k++)
            x.bound[k][l] = found->off[(start + l) * c * c + k];
    }
    size_t bytes = (size_t)count * sizeof(double);
    for (int e = 0, at = 0; e < m->entries; e++) {
        double scale = m->scale[e], *rest = x.rest[e], *size = x.size[e];
        memcpy(rest, found->rest + e * B + start, bytes);
        EACH rest[l] *= scale, size[l] = 0;
        for (int t = 0; t < found->terms; t++, at++) {
            double *term = x.terms[at];
            int some = 0;
            memcpy(term, found->a + at * B + start, bytes);
            EACH some |= term[l] != 0;
            EACH term[l] *= scale, size[l] += fabs(term[l]);
            x.is_term[at] = some;
        }
    }
}

/* Adds to the bound of |I - C M| the parts that vary with the coordinates and the errors, and the remainders. */
WIDE static void add_moving(const Matrix *m, const Ranks *found, RankParts x)
{
    int rows = m->rows, c = m->columns, T = found->terms, first = T - found->errors;
    for (int i = 0; i < c; i++) {
        Lane *bound = x.bound + i * c;
        const Lane *C = (const Lane *)(x.C + i * rows);
        for (int e = 0; e < m->entries; e++) {
            double *to = bound[m->at[2 * e + 1]], *rest = x.rest[e], *size = x.size[e];
            const double *by = C[m->at[2 * e]];
            EACH to[l] += fabs(by[l]) * (rest[l] + PRODUCTS * size[l]);
        }
        for (int t = 0; t < T; t++) {
            memset(x.row, 0, (size_t)c * sizeof(Lane));
            for (int e = 0; e < m->entries; e++) {
                if (!x.is_term[e * T + t])
                    continue;
                const double *term = x.terms[e * T + t], *by = C[m->at[2 * e]];
                double *to = x.row[m->at[2 * e + 1]];
                EACH to[l] += by[l] * term[l];
            }
            for (int j = 0; j < c; j++) {
                double *row = x.row[j], *squares = x.squares[j];
                int part = t < first ? -1 : (t - first) % 3; /* component of an error */
                if (part < 0)
                    EACH bound[j][l] += fabs(row[l]);
                else
                    EACH squares[l] = (part ? squares[l] : TINY) + row[l] * row[l];
                if (part == 2)
                    EACH bound[j][l] += sqrt(squares[l]);
                if (t < found->coordinates)
                    EACH x.linear[(t * c + i) * c + j][l] = fabs(row[l]);
            }
        }
    }
}

/* Returns whether the matrix provably has full rank in the box of lane l; if not, writes the shares of the coordinates in
 * the bound. */
static int judge_lane(const Matrix *m, const Ranks *found, int l, RankParts x, double *shares)
{
    int c = m->columns;
    for (int k = 0; k < c * c; k++) {
        x.B[k] = x.bound[k][l] * (1 + PRODUCTS);
        if (!(x.B[k] < INFINITY))
            return 0;
    }
    int good = is_contracting(x.B, c, x.v, x.w);
    for (int t = 0; t < found->coordinates && !good; t++, shares += found->B) {
        double sum = 0;
        for (int i = 0; i < c; i++)
            for (int j = 0; j < c; j++)
                sum += x.linear[(t * c + i) * c + j][l] * x.v[j] / x.v[i];
        *shares = isfinite(sum) ? sum : 0;
    }
    return good;
}

/* Tests boxes, with shares set to 0 before; without memory, only counts the memory that is needed. */
static void rank_all(const Matrix *m, Ranks *found, Room *room)
{
    RankParts parts = lay_parts(m, found, room);
    for (Py_ssize_t start = 0; room->at && start < found->B; start += LANES) {
        read_forms(m, found, start, parts);
        add_moving(m, found, parts);
        for (int l = 0; l < LANES && start + l < found->B; l++)
            found->regular[start + l] = judge_lane(m, found, l, parts, found->shares + start + l);
    }
}

#endif
