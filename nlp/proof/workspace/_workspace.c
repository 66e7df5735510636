/* Kernel of the search of a workspace for singular poses: the examination of boxes of poses, as in rows.py and
 * regularity.py, whose docstrings and docs/workspace.md explain the formulas.
 *
 * Rounding is to nearest. Never compile this with -ffast-math, which would drop the tests for NaN that keep boxes open.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <string.h>

#if defined(__GNUC__) && __GNUC__ >= 12 && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__)
#define WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define WIDE
#endif

#define N 6           /* coordinates of a pose, legs, and numbers of a row */
#define TURNS 10      /* monomials in three coordinates up to the second order: 1, 3 and 6 */
#define ENTRIES 10    /* numbers of a scaled rotation: nine of the matrix, and the scale */
#define TERMS 22      /* matrices of the expansion of the rows: the centre's, 6 linear, 6 and 9 of second order */
#define ROUNDING 1e-13 /* as in rows.py */
#define OUTWARDS (1 + 1e-12) /* as in rows.py */
#define ULP 0x1p-51
#define TINY 1e-300   /* more than underflow can take from a sum of squares */
#define POWERS 12     /* steps of the power method, as in regularity.py */
#define TIE (1 + 1e-6) /* factor up to which sizes are the same, so that rounding chooses no coordinate */

enum { OPEN, REGULAR, OUTSIDE };
enum { CAYLEY, AXIS, ROLL_PITCH_YAW };

static const int FIRST[6] = {0, 0, 0, 1, 1, 2}, SECOND[6] = {0, 1, 2, 1, 2, 2};

typedef struct {
    int kind;
    const double *base, *platform; /* (6, 3) each */
    const double *axis;            /* (3) */
    double ball;                   /* largest squared size of a Cayley vector; infinite without a ball */
    double tolerance;              /* largest error of each joint centre */
    double length;                 /* of the order of the robot's */
} Robot;

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

/* ---- Scaled rotations: rows.py. ---- */

/* The polynomial of s R and s in Cayley coordinates r = sum_k y_k D_k about a centre. */
static void cayley_form(const double D[3][3], const double *c, double form[TURNS][ENTRIES])
{
    double r[3], rr = 0;
    for (int i = 0; i < 3; i++)
        r[i] = D[0][i] * c[0] + D[1][i] * c[1] + D[2][i] * c[2], rr += r[i] * r[i];
    for (int t = 0; t < TURNS; t++) {
        int k = t < 4 ? t - 1 : FIRST[t - 4], l = t < 4 ? 0 : SECOND[t - 4];
        const double *a = t == 0 ? r : D[k], *b = t < 4 ? r : D[l];
        double twice = t == 0 || (t > 3 && k == l) ? 1 : 2, product = 0;
        for (int i = 0; i < 3; i++)
            product += a[i] * b[i];
        if (t == 0)
            product = rr;
        double scale = twice * product;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                form[t][3 * i + j] = twice * (a[i] * b[j] + b[i] * a[j]) - (i == j ? scale : 0);
        if (t == 0)
            form[t][0] += 1, form[t][4] += 1, form[t][8] += 1;
        form[t][9] = (t == 0) + scale;
        if (t < 4) { /* 2 [r]x, or its derivative 2 [D_k]x */
            form[t][1] -= 2 * a[2], form[t][2] += 2 * a[1], form[t][3] += 2 * a[2];
            form[t][5] -= 2 * a[0], form[t][6] -= 2 * a[1], form[t][7] += 2 * a[0];
        }
    }
}

static void matrix_product(const double *a, const double *b, double *out)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

/* Coefficients of (1 + t^2) times a rotation about axis `about`, and of 1 + t^2, in t - c. */
static void single_turn(int about, double c, double matrix[3][9], double scale[3])
{
    int i = (about + 1) % 3, j = (about + 2) % 3;
    double cosine[3] = {1 - c * c, -2 * c, -1}, sine[3] = {2 * c, 2, 0}, whole[3] = {1 + c * c, 2 * c, 1};
    for (int k = 0; k < 3; k++) {
        memset(matrix[k], 0, 9 * sizeof(double));
        matrix[k][4 * i] = matrix[k][4 * j] = cosine[k];
        matrix[k][3 * j + i] = sine[k], matrix[k][3 * i + j] = -sine[k];
        matrix[k][4 * about] = scale[k] = whole[k];
    }
}

/* The same of Rz(yaw) Ry(pitch) Rx(roll) in the tangents of half the angles; terms of higher order go into rest. */
static void roll_pitch_yaw_form(const double *c, const double *h, double form[TURNS][ENTRIES], double *rest)
{
    double turn[3][3][9], scale[3][3], zy[9], zyx[9];
    static const int index[3][3] = {{4, 5, 6}, {5, 7, 8}, {6, 8, 9}};
    memset(form, 0, TURNS * ENTRIES * sizeof(double));
    memset(rest, 0, ENTRIES * sizeof(double));
    for (int k = 0; k < 3; k++)
        single_turn(k, c[k], turn[k], scale[k]);
    for (int x = 0; x < 3; x++)
        for (int y = 0; y < 3; y++)
            for (int z = 0; z < 3; z++) {
                int order[3] = {x, y, z}, degree = x + y + z, t = 0, seen[2] = {0, 0}, count = 0;
                matrix_product(turn[2][z], turn[1][y], zy);
                matrix_product(zy, turn[0][x], zyx);
                double whole = scale[2][z] * scale[1][y] * scale[0][x], size = 1;
                for (int k = 0; k < 3; k++)
                    for (int d = 0; d < order[k]; d++) {
                        size *= h[k];
                        if (count < 2)
                            seen[count++] = k;
                    }
                if (degree > 2) {
                    for (int e = 0; e < 9; e++)
                        rest[e] += size * fabs(zyx[e]);
                    rest[9] += size * fabs(whole);
                    continue;
                }
                if (degree == 1)
                    t = 1 + seen[0];
                else if (degree == 2)
                    t = index[seen[0]][seen[1]];
                memcpy(form[t], zyx, sizeof zyx);
                form[t][9] = whole;
            }
}

/* ---- Rows: the expansion of the scaled rows about the centre, term by term; rows.py. ---- */

/* Write one row's part of a term, force (3) and moment (3). */
static inline void put(double *row, const double *force, const double *u, const double *arm)
{
    row[0] = force[0], row[1] = force[1], row[2] = force[2];
    row[3] = u[1] * arm[2] - u[2] * arm[1], row[4] = u[2] * arm[0] - u[0] * arm[2], row[5] = u[0] * arm[1] - u[1] * arm[0];
}

static double expand(const Robot *robot, const double *c, const double *h, double rows[N][TERMS * N], double rest[N][N])
{
    static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double form[TURNS][ENTRIES], left[ENTRIES] = {0}, most;
    const double *turn = c + 3, *wide = h + 3;
    if (robot->kind == ROLL_PITCH_YAW) {
        roll_pitch_yaw_form(turn, wide, form, left);
        double a = 1 + fabs(turn[0]) + wide[0], b = 1 + fabs(turn[1]) + wide[1], d = 1 + fabs(turn[2]) + wide[2];
        most = 2 * (a * a) * (b * b) * (d * d);
    } else {
        double D[3][3];
        memcpy(D, unit, sizeof D);
        if (robot->kind == AXIS)
            memset(D, 0, sizeof D), memcpy(D[0], robot->axis, sizeof D[0]);
        cayley_form((const double(*)[3])D, turn, form);
        double size = 1;
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                size += fabs(D[k][i]) * (fabs(turn[k]) + wide[k]);
        most = 2 * size * size;
    }
    double reach = 0;
    for (int i = 0; i < N; i++) {
        const double *a = robot->platform + 3 * i, *b = robot->base + 3 * i;
        double d[3], u[TURNS][3], arm[3], force[3], size[3], sum = fabs(a[0]) + fabs(a[1]) + fabs(a[2]), far = 0;
        double *row = rows[i];
        for (int j = 0; j < 3; j++)
            d[j] = c[j] - b[j], arm[j] = fabs(d[j]) + h[j], far += fabs(c[j]) + fabs(b[j]) + h[j];
        for (int t = 0; t < TURNS; t++)
            for (int j = 0; j < 3; j++)
                u[t][j] = form[t][3 * j] * a[0] + form[t][3 * j + 1] * a[1] + form[t][3 * j + 2] * a[2];
        for (int t = 0; t < TURNS; t++) {
            for (int j = 0; j < 3; j++)
                force[j] = form[t][9] * d[j] + u[t][j];
            /* The centre's matrix is term 0, positions are 1 to 3, turns 4 to 6, second orders 7 to 12, mixed the rest. */
            put(row + N * (t == 0 ? 0 : t + 3), force, u[t], d);
        }
        for (int t = 0; t < 4; t++)
            for (int k = 0; k < 3; k++) {
                for (int j = 0; j < 3; j++)
                    force[j] = form[t][9] * unit[k][j];
                put(row + N * (t == 0 ? 1 + k : 10 + 3 * t + k), force, u[t], unit[k]);
            }
        /* Third order: a second order of the turn times a position; and what the form of the rotation leaves. */
        double scale = left[9], rests[3] = {0, 0, 0};
        for (int j = 0; j < 3; j++)
            size[j] = left[3 * j] * fabs(a[0]) + left[3 * j + 1] * fabs(a[1]) + left[3 * j + 2] * fabs(a[2]);
        double thirds = 0;
        for (int t = 4; t < TURNS; t++) {
            double weight = wide[FIRST[t - 4]] * wide[SECOND[t - 4]];
            thirds += weight * fabs(form[t][9]);
            for (int j = 0; j < 3; j++)
                rests[j] += weight * fabs(u[t][j]);
        }
        double rounding = ROUNDING * most * (far + sum), moment = ROUNDING * most * sum * far;
        for (int j = 0; j < 3; j++) {
            int k = (j + 1) % 3, l = (j + 2) % 3;
            rest[i][j] = thirds * h[j] + scale * arm[j] + size[j] + rounding;
            rest[i][3 + j] = rests[k] * h[l] + rests[l] * h[k] + size[k] * arm[l] + size[l] * arm[k] + moment;
        }
        /* The change by joint centres that are off by at most the tolerance. */
        if (robot->tolerance > 0) {
            double most_scale = fabs(form[0][9]) + thirds + scale, sizes[3], outwards = robot->tolerance * OUTWARDS;
            for (int t = 1; t < 4; t++)
                most_scale += fabs(form[t][9]) * wide[t - 1];
            for (int j = 0; j < 3; j++) {
                sizes[j] = fabs(u[0][j]) + rests[j] + size[j];
                for (int t = 1; t < 4; t++)
                    sizes[j] += wide[t - 1] * fabs(u[t][j]);
            }
            for (int j = 0; j < 3; j++) {
                int k = (j + 1) % 3, l = (j + 2) % 3;
                double turned = sqrt(sizes[k] * sizes[k] + sizes[l] * sizes[l] + TINY);
                double arms = sqrt(arm[k] * arm[k] + arm[l] * arm[l] + TINY);
                rest[i][j] += 2 * most_scale * outwards;
                rest[i][3 + j] += (most_scale * arms + turned + most_scale * robot->tolerance) * outwards;
            }
        }
        reach = larger(reach, far);
    }
    return reach;
}

/* ---- The test: regularity.py. ---- */

/* Invert A by elimination with pivots; return the sign of its determinant, 0 where it has no inverse. */
static int invert(const double *A, double out[N][N])
{
    double work[N][2 * N];
    int sign = 1;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            work[i][j] = A[(size_t)i * TERMS * N + j], work[i][N + j] = i == j;
    for (int k = 0; k < N; k++) {
        int best = k;
        for (int i = k + 1; i < N; i++)
            if (fabs(work[i][k]) > fabs(work[best][k]))
                best = i;
        double pivot = work[best][k];
        if (!(fabs(pivot) > 0) || !isfinite(pivot))
            return 0;
        if (best != k) {
            double swap[2 * N];
            memcpy(swap, work[best], sizeof swap), memcpy(work[best], work[k], sizeof swap), memcpy(work[k], swap, sizeof swap);
            sign = -sign;
        }
        if (pivot < 0)
            sign = -sign;
        double inverse = 1 / pivot;
        for (int j = 0; j < 2 * N; j++)
            work[k][j] *= inverse;
        for (int i = 0; i < N; i++)
            if (i != k) {
                double factor = work[i][k];
                for (int j = 0; j < 2 * N; j++)
                    work[i][j] -= factor * work[k][j];
            }
    }
    for (int i = 0; i < N; i++)
        memcpy(out[i], work[i] + N, N * sizeof(double));
    return sign;
}

/* Return whether a vector proves that the spectral radius of a nonnegative matrix is below 1; write the vector. */
static int is_contraction(const double B[N][N], double length, double *v)
{
    double w[N];
    for (int i = 0; i < N; i++)
        v[i] = i < 3 ? length : 1;
    for (int step = 0; step < POWERS; step++) {
        double least = INFINITY, most = 0, sum = 0;
        for (int i = 0; i < N; i++) {
            w[i] = 0;
            for (int j = 0; j < N; j++)
                w[i] += B[i][j] * v[j];
            double ratio = w[i] / v[i];
            if (!(ratio < INFINITY))
                return 0;
            least = smaller(least, ratio), most = larger(most, ratio), sum += w[i] / (i < 3 ? length : 1);
        }
        if (most < 1 - 64 * ULP)
            return 1;
        if (least >= 1)
            return 0;
        for (int i = 0; i < N; i++)
            v[i] = w[i] / sum + 1e-12 * v[i];
    }
    return 0;
}

/* Move the ends of a box of Cayley vectors to the ball; return whether nothing is left. */
static int contract(const Robot *robot, double *lower, double *upper)
{
    if (!(robot->ball < INFINITY))
        return 0;
    double least[3], sum = 0;
    for (int k = 0; k < 3; k++) {
        double low = lower[3 + k], high = upper[3 + k];
        least[k] = low > 0 ? low : high < 0 ? -high : 0;
        sum += least[k] * least[k];
    }
    double slack = 4 * ULP * (robot->ball + sum);
    if (sum > robot->ball + slack)
        return 1;
    for (int k = 0; k < 3; k++) {
        double room = robot->ball - (sum - least[k] * least[k]) + slack, most = sqrt(larger(room, 0)) * (1 + ULP);
        lower[3 + k] = larger(lower[3 + k], -most), upper[3 + k] = smaller(upper[3 + k], most);
        if (!(lower[3 + k] <= upper[3 + k]))
            return 1;
    }
    return 0;
}

WIDE static void examine_box(const Robot *robot, double *lower, double *upper, int *verdict, int *split, int *sign)
{
    double c[N], h[N], rows[N][TERMS * N], rest[N][N], C[N][N], product[N][TERMS * N], B[N][N], v[N];
    double inside = 0, widest = -1;
    *sign = 0, *split = 0, *verdict = OPEN;
    if (contract(robot, lower, upper)) {
        *verdict = OUTSIDE;
        return;
    }
    for (int k = 0; k < N; k++) {
        c[k] = 0.5 * lower[k] + 0.5 * upper[k];
        h[k] = larger(upper[k] - c[k], c[k] - lower[k]) * (1 + ULP);
        double width = h[k] / (k < 3 ? robot->length : 1);
        if (width > widest * TIE)
            widest = width, *split = k;
        if (k > 2)
            inside += c[k] * c[k];
    }
    expand(robot, c, h, rows, rest);
    if (inside <= robot->ball)
        *sign = invert(rows[0], C);
    /* The square of a coordinate is half its largest value, plus or minus as much. */
    double factor[TERMS];
    for (int t = 0; t < TERMS; t++)
        factor[t] = t == 0 ? 1 : t < 7 ? h[t - 1] : t < 13 ? h[3 + FIRST[t - 7]] * h[3 + SECOND[t - 7]] : h[3 + (t - 13) / 3] * h[(t - 13) % 3];
    for (int t = 7; t < 13; t++)
        if (FIRST[t - 7] == SECOND[t - 7]) {
            factor[t] *= 0.5;
            for (int i = 0; i < N; i++)
                for (int j = 0; j < N; j++)
                    rows[i][j] += factor[t] * rows[i][t * N + j];
        }
    if (invert(rows[0], C) == 0)
        return;
    for (int i = 0; i < N; i++) {
        double *out = product[i];
        for (int j = 0; j < TERMS * N; j++)
            out[j] = C[i][0] * rows[0][j];
        for (int k = 1; k < N; k++) {
            double each = C[i][k];
            for (int j = 0; j < TERMS * N; j++)
                out[j] += each * rows[k][j];
        }
        for (int j = 0; j < N; j++) {
            double sum = fabs(out[j] - (i == j)), extra = 0;
            for (int t = 1; t < TERMS; t++)
                sum += factor[t] * fabs(out[t * N + j]);
            for (int k = 0; k < N; k++)
                extra += fabs(C[i][k]) * rest[k][j];
            B[i][j] = (sum + extra) * (1 + 64 * ULP);
        }
    }
    if (is_contraction((const double(*)[N])B, robot->length, v)) {
        *verdict = REGULAR;
        return;
    }
    widest = -1;
    for (int k = 0; k < N; k++) {
        double sum = 0;
        for (int i = 0; i < N; i++)
            for (int j = 0; j < N; j++)
                sum += fabs(product[i][(k + 1) * N + j]) * v[j] / v[i];
        if (h[k] * sum > widest * TIE)
            widest = h[k] * sum, *split = k;
    }
}

/* ---- Python. ---- */

static void *borrow(PyObject *array, Py_buffer *buffer, Py_ssize_t bytes, int writable)
{
    if (PyObject_GetBuffer(array, buffer, writable ? PyBUF_CONTIG : PyBUF_CONTIG_RO) < 0)
        return NULL;
    if (buffer->len != bytes) {
        PyErr_SetString(PyExc_ValueError, "the kernel got an array of another size");
        PyBuffer_Release(buffer);
        return NULL;
    }
    return buffer->buf;
}

static PyObject *examine(PyObject *module, PyObject *args)
{
    PyObject *arrays[8];
    Robot robot;
    Py_ssize_t count;
    Py_buffer buffers[8];
    void *parts[8];
    int taken = 0, good = 1;
    (void)module;
    if (!PyArg_ParseTuple(args, "idddnOOOOOOOO", &robot.kind, &robot.ball, &robot.tolerance, &robot.length, &count, &arrays[0], &arrays[1],
                          &arrays[2], &arrays[3], &arrays[4], &arrays[5], &arrays[6], &arrays[7]))
        return NULL;
    Py_ssize_t D = sizeof(double), sizes[8] = {18 * D, 18 * D, 3 * D, count * N * D, count * N * D, count * (Py_ssize_t)sizeof(int),
                                               count * (Py_ssize_t)sizeof(int), count * (Py_ssize_t)sizeof(int)};
    for (int i = 0; i < 8 && good; i++) {
        good = (parts[i] = borrow(arrays[i], &buffers[i], sizes[i], i > 2)) != NULL;
        taken += good;
    }
    if (good) {
        robot.base = parts[0], robot.platform = parts[1], robot.axis = parts[2];
        double *lower = parts[3], *upper = parts[4];
        int *verdict = parts[5], *split = parts[6], *sign = parts[7];
        Py_BEGIN_ALLOW_THREADS
        for (Py_ssize_t b = 0; b < count; b++)
            examine_box(&robot, lower + N * b, upper + N * b, verdict + b, split + b, sign + b);
        Py_END_ALLOW_THREADS
    }
    for (int i = 0; i < taken; i++)
        PyBuffer_Release(&buffers[i]);
    if (!good)
        return NULL;
    Py_RETURN_NONE;
}

static PyMethodDef methods[] = {
    {"examine", examine, METH_VARARGS,
     "examine(kind, ball, tolerance, length, B, base, platform, axis, lower, upper, verdict, split, sign)\n\n"
     "Examine B boxes of poses (B, 6) for regular rows; the boxes are contracted in place."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_workspace", "Regular rows over boxes of poses.", -1, methods,
                                    NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__workspace(void) { return PyModule_Create(&module); }
