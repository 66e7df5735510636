/* The rank of a matrix over boxes, from forms of second order of its entries; workspace/ranks/rank_rule.py. */
#ifndef RANK_H
#define RANK_H

#include "runs.h"

/* Part of the sum of the sizes of all terms by which a computed sum of products may be off: fewer than 400 roundings. */
#define PRODUCTS 1e-13
#define RANK_POWERS 12
#define NORM_POWERS 6
/* Smallest singular value, in parts of the largest, below which the direction that it belongs to becomes a column. */
#define NEAR_SINGULAR 0.01

typedef struct {
    int rows, columns, nullity, entries;
    const int *at;          /* (entries, 2) row and column of each result of the tape */
    const double *scale;    /* (entries) powers of two */
    const double *constant; /* (rows, columns) what is the same everywhere */
} Matrix;

typedef struct {
    const double *lower, *upper; /* (n, B) */
    const double *change;        /* (entries, B) by how much entries may be off, or NULL */
    int *regular, *sign;         /* (B), (B) of the determinant of a square matrix, else 0 */
    double *shares, *smallest;   /* (n, B), (B) */
    Py_ssize_t B;
} Ranks;

/* Parts of LANES boxes, and of one of them: A has the middle and, below it, a basis of its null space. Near a singular
 * matrix it is that of A V, V = I - t t', whose columns have the direction in which A is nearly singular as one: the
 * bounds of |I - C A V| are then near the change of the smallest singular value. */
typedef struct {
    Lane *C, *bound, *linear, *row, *middle, *rest, *size, *turn;
    double *A, *inverse, *work, *B, *v, *w, *t;
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
    double diagonal, factors[64];
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

static RankParts lay_parts(const Matrix *m, int n, Room *room)
{
    size_t rows = (size_t)(m->rows + m->nullity), c = (size_t)m->columns, E = (size_t)m->entries;
    RankParts x;
    x.C = (Lane *)carve(room, rows * c * LANES), x.bound = (Lane *)carve(room, c * c * LANES);
    x.linear = (Lane *)carve(room, (size_t)n * c * c * LANES), x.row = (Lane *)carve(room, c * LANES);
    x.turn = (Lane *)carve(room, c * LANES);
    x.middle = (Lane *)carve(room, E * LANES), x.rest = (Lane *)carve(room, E * LANES);
    x.size = (Lane *)carve(room, E * LANES);
    x.A = carve(room, rows * c), x.inverse = carve(room, rows * c), x.work = carve(room, rows * c + 2 * (rows + c));
    x.B = carve(room, c * c), x.v = carve(room, rows + c), x.w = carve(room, rows + c), x.t = carve(room, c);
    return x;
}

/* Middles of the entries, the sizes of what moves about them, and what is left; the square of a coordinate is a half,
 * plus or minus as much. */
static void middles_of(const Matrix *m, int n, Store out, const Ranks *found, Py_ssize_t start, RankParts x)
{
    for (int e = 0; e < m->entries; e++) {
        const Value *v = value_of(out, e);
        const Lane *terms = terms_of(v);
        double scale = m->scale[e];
        double *middle = x.middle[e], *size = x.size[e], *rest = x.rest[e];
        EACH middle[l] = v->c[l] + 0.5 * (v->p[l] + v->q[l]), size[l] = 0;
        EACH_OF(i, 0, v->terms.linear)
        {
            EACH size[l] += fabs(terms[i][l]);
            EACH_OF(j, i, v->terms.pairs[i])
            {
                const double *term = terms[row_of(n, i) + j];
                if (i == j)
                    EACH middle[l] += 0.5 * term[l], size[l] += 0.5 * fabs(term[l]);
                else
                    EACH size[l] += fabs(term[l]);
            }
        }
        /* The middle is a sum of n + 2 terms, the half width of two. */
        EACH
        {
            double half = 0.5 * (v->q[l] - v->p[l]);
            double rounding = (n + 6) * ULP * (fabs(v->c[l]) + half + size[l] + fabs(middle[l]));
            rest[l] = scale * (half + v->s[l] + rounding) * (1 + 4 * ULP), middle[l] *= scale, size[l] *= scale;
        }
        for (int l = 0; found->change && l < LANES && start + l < found->B; l++)
            rest[l] = (rest[l] + scale * found->change[e * found->B + start + l]) * (1 + 4 * ULP);
    }
}

/* A row times V, or sizes times |V|. */
static void turn_row(int c, const double *t, double *row, int sizes)
{
    double sum = 0;
    for (int j = 0; j < c; j++)
        sum += row[j] * (sizes ? fabs(t[j]) : -t[j]);
    for (int j = 0; j < c; j++)
        row[j] += sum * (sizes ? fabs(t[j]) : t[j]);
}

/* Writes t, and the inverse of A V in the place of that of A. V is a reflection of the direction w of the largest
 * singular value of the inverse to the axis that is nearest to it; I where this is not meant. */
static void turn_columns(int rows, int c, RankParts x, int is_meant)
{
    double size = 0;
    int axis = 0;
    for (int i = 0; i < c; i++) {
        x.t[i] = is_meant ? x.w[i] : 0.0, size += x.t[i] * x.t[i];
        axis = fabs(x.t[i]) > fabs(x.t[axis]) * (1 + TIE) ? i : axis;
    }
    if (!(size > 0))
        return;
    x.t[axis] += x.t[axis] > 0 ? sqrt(size) : -sqrt(size);
    double scale = 1 / sqrt(size + sqrt(size) * (fabs(x.t[axis]) - sqrt(size)));
    for (int i = 0; i < c; i++)
        x.t[i] *= scale;
    for (int r = 0; r < rows; r++) {
        double sum = 0;
        for (int i = 0; i < c; i++)
            sum += x.t[i] * x.inverse[i * rows + r];
        for (int i = 0; i < c; i++)
            x.inverse[i * rows + r] -= sum * x.t[i];
    }
}

/* Whether the middle of lane l has a left inverse, which goes into C: the sign of left_inverse, or 0; how
 * singular it is. */
static int invert_lane(const Matrix *m, int l, RankParts x, double *smallest, double near)
{
    int rows = m->rows + m->nullity, c = m->columns, known = 1;
    memcpy(x.A, m->constant, (size_t)(m->rows * c) * sizeof(double));
    for (int e = 0; e < m->entries; e++) {
        x.A[m->at[2 * e] * c + m->at[2 * e + 1]] += x.middle[e][l];
        known &= x.rest[e][l] < INFINITY;
    }
    *smallest = known ? 0 : INFINITY;
    if (known && m->nullity)
        null_space(x.A, m->rows, c, m->nullity, x.A + m->rows * c, x.work);
    int good = known ? left_inverse(x.A, rows, c, x.inverse, x.work) : 0;
    if (good) {
        double largest = norm_of(x.A, rows, c, x.v, x.w), far = norm_of(x.inverse, c, rows, x.v, x.w);
        *smallest = 1 / (far * largest);
        turn_columns(rows, c, x, *smallest < near);
    }
    for (int k = 0; k < rows * c; k++)
        x.C[k][l] = good ? x.inverse[k] : 0.0;
    for (int k = 0; k < c; k++)
        x.turn[k][l] = good ? x.t[k] : 0.0;
    if (!good)
        return 0;
    for (int i = 0; i < c; i++) {
        const double *Ci = x.inverse + i * rows;
        for (int j = 0; j < c; j++)
            x.v[j] = x.w[j] = 0;
        for (int r = 0; r < rows; r++)
            for (int j = 0; j < c; j++)
                x.v[j] += Ci[r] * x.A[r * c + j], x.w[j] += fabs(Ci[r] * x.A[r * c + j]);
        turn_row(c, x.t, x.v, 0), turn_row(c, x.t, x.w, 1);
        for (int j = 0; j < c; j++)
            x.bound[i * c + j][l] = fabs(x.v[j] - (i == j)) + PRODUCTS * (x.w[j] + (i == j));
    }
    return good;
}

/* Adds the parts of |I - C M| that move with the coordinates, and what is left. */
WIDE static void add_moving(const Matrix *m, int n, Store out, RankParts x)
{
    int rows = m->rows + m->nullity, c = m->columns;
    for (int i = 0; i < c; i++) {
        Lane *bound = x.bound + i * c;
        const Lane *C = (const Lane *)(x.C + i * rows);
        Lane sum;
        memset(x.row, 0, (size_t)c * sizeof(Lane));
        for (int e = 0; e < m->entries; e++) {
            double *to = x.row[m->at[2 * e + 1]], *rest = x.rest[e], *size = x.size[e];
            const double *by = C[m->at[2 * e]];
            EACH to[l] += fabs(by[l]) * (rest[l] + PRODUCTS * size[l]);
        }
        EACH sum[l] = 0.0;
        for (int j = 0; j < c; j++)
            EACH sum[l] += x.row[j][l] * fabs(x.turn[j][l]);
        for (int j = 0; j < c; j++)
            EACH bound[j][l] += x.row[j][l] + sum[l] * fabs(x.turn[j][l]);
        for (int a = 0, t = 0; a < n + n; a++)
            for (int b = a < n ? n - 1 : a - n; b < n; b++, t++) {
                /* First the terms of first order, then the pairs, row by row; the scales of a column are one number. */
                double part = a >= n && b == a - n ? 0.5 : 1.0;
                memset(x.row, 0, (size_t)c * sizeof(Lane));
                for (int e = 0; e < m->entries; e++) {
                    const Value *v = value_of(out, e);
                    if (!((a < n ? v->terms.linear >> a : v->terms.pairs[a - n] >> b) & 1))
                        continue;
                    const double *term = terms_of(v)[t], *by = C[m->at[2 * e]];
                    double *to = x.row[m->at[2 * e + 1]], scale = part * m->scale[e];
                    EACH to[l] += by[l] * (term[l] * scale);
                }
                EACH sum[l] = 0.0;
                for (int j = 0; j < c; j++)
                    EACH sum[l] += x.row[j][l] * x.turn[j][l];
                for (int j = 0; j < c; j++)
                    EACH
                    {
                        x.row[j][l] -= sum[l] * x.turn[j][l];
                        bound[j][l] += fabs(x.row[j][l]);
                    }
                if (a < n)
                    for (int j = 0; j < c; j++)
                        EACH x.linear[(t * c + i) * c + j][l] = fabs(x.row[j][l]);
            }
    }
}

/* Whether the matrix surely has full rank in the box of lane l, and the shares of the coordinates in the bound. */
static int judge_lane(const Matrix *m, int n, int l, RankParts x, double *shares)
{
    int c = m->columns;
    for (int k = 0; k < c * c; k++) {
        x.B[k] = x.bound[k][l] * (1 + PRODUCTS);
        if (!(x.B[k] < INFINITY))
            return 0;
    }
    int good = is_contracting(x.B, c, x.v, x.w);
    for (int t = 0; t < n && !good; t++) {
        double sum = 0;
        for (int i = 0; i < c; i++)
            for (int j = 0; j < c; j++)
                sum += x.linear[(t * c + i) * c + j][l] * x.v[j] / x.v[i];
        shares[t] = isfinite(sum) ? sum : 0;
    }
    return good;
}

/* Judges boxes; without memory, what they need of it is counted only. */
static void rank_all(const Tape *tape, const Matrix *m, int n, Ranks *found, Room *room)
{
    Run run = prepare(tape, n, 2, room);
    RankParts parts = lay_parts(m, n, room);
    /* V makes what does not become small with the box larger. */
    double near = found->change ? 0 : NEAR_SINGULAR;
    for (Py_ssize_t start = 0; room->at && start < found->B; start += LANES) {
        run_block(&run, found->lower, found->upper, found->B, NULL, start, found->B);
        middles_of(m, n, run.out, found, start, parts);
        int ready[LANES] = {0};
        EACH if (start + l < found->B) ready[l] = invert_lane(m, l, parts, found->smallest + start + l, near);
        add_moving(m, n, run.out, parts);
        for (int l = 0; l < LANES && start + l < found->B; l++) {
            double shares[64] = {0};
            found->regular[start + l] = ready[l] && judge_lane(m, n, l, parts, shares);
            found->sign[start + l] = m->rows == m->columns && !m->nullity ? ready[l] : 0;
            for (int i = 0; i < n; i++)
                found->shares[i * found->B + start + l] = shares[i];
        }
    }
}

#endif
