/* The rank of a matrix over boxes, from forms of its entries; workspace/ranks/rank_rule.py. */
#ifndef RANK_H
#define RANK_H

#include <Python.h>
#include "values.h"

/* Part of the sum of the sizes of all terms by which a computed sum of products may be off: fewer than 400 roundings, those
 * of the middles among them. */
#define PRODUCTS 1e-13
#define RANK_POWERS 12
#define NORM_POWERS 6
#define MOST_COLUMNS 1024

typedef struct {
    int rows, columns, nullity, entries;
    const int *at;          /* (entries, 2) row and column of each entry */
    const double *scale;    /* (entries) powers of two */
    const double *constant; /* (rows, columns) what is the same everywhere */
} Matrix;

/* Forms of the entries: middle + terms e + [-rest, rest]. The coordinates come first, the errors of joint centres last:
 * three of each, which are a vector of at most unit length. */
typedef struct {
    int terms, coordinates, errors;
    const double *middle, *a, *rest; /* (entries, B), a: (entries, terms, B) */
    int *regular, *sign;             /* (B), (B) of the determinant of a square matrix, else 0 */
    double *shares, *smallest;       /* (coordinates, B), (B) */
    Py_ssize_t B;
} Ranks;

/* Parts of LANES boxes, and of one of them: A has the middle and, below it, a basis of its null space. */
typedef struct {
    Lane *C, *bound, *linear, *row, *squares, *middle, *rest, *size, *terms;
    int *is_term; /* (entries, terms) whether a term differs from 0 in one of the boxes */
    double *A, *inverse, *work, *B, *v, *w;
} RankParts;

/* Applies the reflection in column k of a matrix (rows, columns), from row k on, to a vector with a step between entries. */
static void apply_reflection(const double *M, int rows, int columns, int k, double factor, double *vector, int step)
{
    double sum = 0;
    for (int i = k; i < rows; i++)
        sum += M[i * columns + k] * vector[i * step];
    sum *= factor;
    for (int i = k; i < rows; i++)
        vector[i * step] -= sum * M[i * columns + k];
}

/* Turns column k of a matrix (rows, columns), from row k on, to its first entry by a reflection, and the later columns
 * with it. The reflection's vector stays in the column, its factor is returned; 0 for a column of zeros. */
static double reflect(double *M, int rows, int columns, int k, double *diagonal)
{
    double size = 0;
    for (int i = k; i < rows; i++)
        size += M[i * columns + k] * M[i * columns + k];
    size = sqrt(size);
    *diagonal = 0;
    if (!(size > 0) || !isfinite(size))
        return 0;
    double head = M[k * columns + k], factor = 1 / (size * (size + fabs(head)));
    *diagonal = head > 0 ? -size : size;
    M[k * columns + k] = head - *diagonal;
    for (int j = k + 1; j < columns; j++)
        apply_reflection(M, rows, columns, k, factor, M + j, columns);
    return factor;
}

/* Writes an orthonormal basis (nullity, columns) of what the rows of a matrix miss, from reflections of its columns'
 * space with the longest row first. */
static void null_space(const double *A, int rows, int columns, int nullity, double *basis, double *M)
{
    double diagonal, factors[MOST_COLUMNS];
    int rank = columns - nullity;
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < columns; j++)
            M[j * rows + i] = A[i * columns + j];
    for (int k = 0; k < rank; k++) {
        int longest = k;
        double most = -1;
        for (int i = k; i < rows; i++) {
            double size = 0;
            for (int j = k; j < columns; j++)
                size += M[j * rows + i] * M[j * rows + i];
            if (size > most)
                most = size, longest = i;
        }
        for (int j = 0; longest != k && j < columns; j++) {
            double swap = M[j * rows + k];
            M[j * rows + k] = M[j * rows + longest], M[j * rows + longest] = swap;
        }
        factors[k] = reflect(M, columns, rows, k, &diagonal);
    }
    for (int d = 0; d < nullity; d++) {
        double *row = basis + d * columns;
        for (int j = 0; j < columns; j++)
            row[j] = j == rank + d;
        for (int k = rank - 1; k >= 0; k--)
            apply_reflection(M, columns, rows, k, factors[k], row, 1);
    }
}

/* Writes a left inverse C (columns, rows) of A (rows, columns) of full column rank; returns 0 where it has none, else the
 * sign of the determinant of a square A: each reflection changes it. */
static int left_inverse(const double *A, int rows, int columns, double *C, double *work)
{
    double *M = work, *diagonal = work + rows * columns, *factors = diagonal + columns, *column = factors + columns;
    int sign = 1;
    memcpy(M, A, (size_t)(rows * columns) * sizeof(double));
    for (int k = 0; k < columns; k++) {
        factors[k] = reflect(M, rows, columns, k, &diagonal[k]);
        if (!(fabs(diagonal[k]) > 0))
            return 0;
        sign = diagonal[k] > 0 ? -sign : sign;
    }
    for (int r = 0; r < rows; r++) {
        /* Column r of the transposed reflections, then back substitution. */
        for (int i = 0; i < rows; i++)
            column[i] = i == r;
        for (int k = 0; k < columns; k++)
            apply_reflection(M, rows, columns, k, factors[k], column, 1);
        for (int k = columns - 1; k >= 0; k--) {
            double sum = column[k];
            for (int j = k + 1; j < columns; j++)
                sum -= M[k * columns + j] * C[j * rows + r];
            C[k * rows + r] = sum / diagonal[k];
        }
    }
    return sign;
}

/* About the largest singular value of a matrix (rows, columns). */
static double norm_of(const double *M, int rows, int columns, double *v, double *w)
{
    double size = 0;
    for (int j = 0; j < columns; j++)
        v[j] = 1 + 0.1 * j;
    for (int step = 0; step < NORM_POWERS; step++) {
        double sum = 0, all = 0;
        for (int i = 0; i < rows; i++) {
            w[i] = 0;
            for (int j = 0; j < columns; j++)
                w[i] += M[i * columns + j] * v[j];
        }
        for (int j = 0; j < columns; j++) {
            all += v[j] * v[j], v[j] = 0;
            for (int i = 0; i < rows; i++)
                v[j] += M[i * columns + j] * w[i];
            sum += v[j] * v[j];
        }
        size = sqrt(sqrt(sum / all));
        double scale = sum > 0 ? 1 / sqrt(sum) : 0;
        for (int j = 0; j < columns; j++)
            v[j] *= scale;
    }
    return size;
}

/* Whether a vector shows that the spectral radius of a nonnegative matrix (c, c) is below 1; writes the vector. */
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
    size_t rows = (size_t)(m->rows + m->nullity), c = (size_t)m->columns, E = (size_t)m->entries, T = (size_t)found->terms;
    RankParts x;
    x.C = (Lane *)carve(room, rows * c * LANES), x.bound = (Lane *)carve(room, c * c * LANES);
    x.linear = (Lane *)carve(room, (size_t)found->coordinates * c * c * LANES);
    x.row = (Lane *)carve(room, c * LANES), x.squares = (Lane *)carve(room, c * LANES);
    x.middle = (Lane *)carve(room, E * LANES), x.rest = (Lane *)carve(room, E * LANES);
    x.size = (Lane *)carve(room, E * LANES), x.terms = (Lane *)carve(room, E * T * LANES);
    x.is_term = (int *)carve(room, E * T);
    x.A = carve(room, rows * c), x.inverse = carve(room, rows * c), x.work = carve(room, rows * c + 2 * (rows + c));
    x.B = carve(room, c * c), x.v = carve(room, rows + c), x.w = carve(room, rows + c);
    return x;
}

/* Reads the scaled forms of boxes from number start on, and the sizes of what moves about their middles. */
WIDE static void read_forms(const Matrix *m, const Ranks *found, Py_ssize_t start, RankParts x)
{
    Py_ssize_t B = found->B;
    size_t bytes = (size_t)(B - start < LANES ? B - start : LANES) * sizeof(double);
    for (int e = 0, at = 0; e < m->entries; e++) {
        double scale = m->scale[e], *middle = x.middle[e], *rest = x.rest[e], *size = x.size[e];
        memcpy(middle, found->middle + e * B + start, bytes), memcpy(rest, found->rest + e * B + start, bytes);
        EACH middle[l] *= scale, rest[l] *= scale, size[l] = 0;
        for (int t = 0; t < found->terms; t++, at++) {
            double *term = x.terms[at];
            int some = 0;
            memcpy(term, found->a + at * B + start, bytes);
            EACH some |= term[l] != 0;
            EACH some |= term[l] != 0;
            EACH term[l] *= scale, size[l] += fabs(term[l]);
            x.is_term[at] = some;
        }
    }
}

/* Whether the middle of lane l has a left inverse, which goes into C: the sign of left_inverse, or 0; how
 * singular it is. */
static int invert_lane(const Matrix *m, int l, RankParts x, double *smallest)
{
    int rows = m->rows + m->nullity, c = m->columns, known = 1;
    memcpy(x.A, m->constant, (size_t)(m->rows * c) * sizeof(double));
    for (int e = 0; e < m->entries; e++) {
        x.A[m->at[2 * e] * c + m->at[2 * e + 1]] += x.middle[e][l];
        known &= x.rest[e][l] < INFINITY && x.size[e][l] < INFINITY && fabs(x.middle[e][l]) < INFINITY;
    }
    *smallest = known ? 0 : INFINITY;
    if (known && m->nullity)
        null_space(x.A, m->rows, c, m->nullity, x.A + m->rows * c, x.work);
    int good = known ? left_inverse(x.A, rows, c, x.inverse, x.work) : 0;
    if (good) {
        double largest = norm_of(x.A, rows, c, x.v, x.w), far = norm_of(x.inverse, c, rows, x.v, x.w);
        *smallest = 1 / (far * largest);
    }
    for (int k = 0; k < rows * c; k++)
        x.C[k][l] = good ? x.inverse[k] : 0.0;
    if (!good)
        return 0;
    for (int i = 0; i < c; i++) {
        const double *Ci = x.inverse + i * rows;
        for (int j = 0; j < c; j++)
            x.v[j] = x.w[j] = 0;
        for (int r = 0; r < rows; r++)
            for (int j = 0; j < c; j++)
                x.v[j] += Ci[r] * x.A[r * c + j], x.w[j] += fabs(Ci[r] * x.A[r * c + j]);
        for (int j = 0; j < c; j++)
            x.bound[i * c + j][l] = fabs(x.v[j] - (i == j)) + PRODUCTS * (x.w[j] + (i == j));
    }
    return good;
}

/* Adds the parts of |I - C M| that move with the coordinates and the errors, and what is left. */
WIDE static void add_moving(const Matrix *m, const Ranks *found, RankParts x)
{
    int rows = m->rows + m->nullity, c = m->columns, T = found->terms, first = T - found->errors;
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
                int part = t < first ? -1 : (t - first) % 3; /* of an error */
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

/* Whether the matrix surely has full rank in the box of lane l; if not, the shares of the coordinates in the bound. */
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

/* Judges boxes, whose shares are 0 at first; without memory, what they need of it is counted only. */
static void rank_all(const Matrix *m, Ranks *found, Room *room)
{
    RankParts parts = lay_parts(m, found, room);
    for (Py_ssize_t start = 0; room->at && start < found->B; start += LANES) {
        read_forms(m, found, start, parts);
        int ready[LANES] = {0};
        EACH if (start + l < found->B) ready[l] = invert_lane(m, l, parts, found->smallest + start + l);
        add_moving(m, found, parts);
        for (int l = 0; l < LANES && start + l < found->B; l++) {
            found->regular[start + l] = ready[l] && judge_lane(m, found, l, parts, found->shares + start + l);
            found->sign[start + l] = m->rows == m->columns && !m->nullity ? ready[l] : 0;
        }
    }
}

#endif
