/* Reference solution of the torsional gear pair: Taylor series of the piecewise linear equations, event by event.
 *
 * Between two changes of contact state the equations are linear with constant coefficients, so the Taylor
 * coefficients of the state follow from a two-term recurrence and the series converges for every step. The roots of
 * the mesh deformation d (events) and of its derivative (extrema) are isolated by derivative bounds of the polynomial
 * - an interval is accepted as free of roots, or as monotone, only when the bound says so - and polished by Newton's
 * method in the working precision.
 *
 * The working precision is __float128 (113 bits), or long double (64 bits) with -DUSE_LONG_DOUBLE.
 *
 * usage: reference p2|p3 FIRST LAST STEP ORDER REACH OUTPUT
 *   p2, p3             [0, 0.2] s, events and d(t) at 2001 times | [0, 0.3] s, extrema of d in [0.25, 0.3] s
 *   FIRST LAST STEP    speeds, rpm
 *   ORDER              of the Taylor series (40)
 *   REACH              step times the fastest circular frequency of the contact state (2)
 */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef USE_LONG_DOUBLE
typedef long double real;
#define SIN sinl
#define COS cosl
#define FABS fabsl
#define R(x) x##L
#define EPS 1.0842e-19L
static void print_real(FILE *f, real x) { fprintf(f, "%.21Le", x); }
#else
#include <quadmath.h>
typedef __float128 real;
#define SIN sinq
#define COS cosq
#define FABS fabsq
#define R(x) x##Q
#define EPS 1.93e-34Q
static void print_real(FILE *f, real x)
{
    char text[64];
    quadmath_snprintf(text, sizeof text, "%.30Qe", x);
    fputs(text, f);
}
#endif

#define PI R(3.14159265358979323846264338327950288419716939937510)
#define MAX_ORDER 80
#define MAX_ROOTS 64

static const real inertia[4] = {R(0.1), R(0.00794), R(0.00794), R(0.1)};
static const real shaft = R(6.2905e4), damping_factor = R(5e-4), radius = R(0.08), mesh = R(8e8), backlash = R(1e-4);
static const real error_sine = R(5e-5), teeth = R(40.0), torque = R(100.0);

/* Fastest circular frequency that the step has to resolve, rad/s: mesh in contact; forcing or shaft in the gap. */
static const double fastest_contact = 36023.0, fastest_gap = 12567.0;

typedef struct { real phi[4], v[4]; } state_t;
typedef struct { real d[MAX_ORDER + 1]; state_t s[MAX_ORDER + 1]; } series_t;

/* Taylor coefficients about time t in contact state side (+1 working flank, 0 gap, -1 back flank). */
static void expand(const state_t *start, real t, real omega, int side, int order, series_t *y)
{
    real sine = SIN(omega * t), cosine = COS(omega * t);
    y->s[0] = *start;
    for (int k = 0; k <= order; ++k) {
        const real *phi = y->s[k].phi, *v = y->s[k].v;
        y->d[k] = radius * (phi[1] - phi[2]) + error_sine * sine;
        if (k == order) break;
        real force = side == 0 ? 0 : mesh * (y->d[k] + (k == 0 && side < 0 ? backlash : 0));
        real shaft1 = shaft * (phi[0] - phi[1] + damping_factor * (v[0] - v[1]));
        real shaft2 = shaft * (phi[2] - phi[3] + damping_factor * (v[2] - v[3]));
        real load = k == 0 ? torque : 0;
        real divisor = R(1.0) / (k + 1);
        for (int i = 0; i < 4; ++i) y->s[k + 1].phi[i] = v[i] * divisor;
        y->s[k + 1].v[0] = (load - shaft1) / inertia[0] * divisor;
        y->s[k + 1].v[1] = (shaft1 - radius * force) / inertia[1] * divisor;
        y->s[k + 1].v[2] = (-shaft2 + radius * force) / inertia[2] * divisor;
        y->s[k + 1].v[3] = (-load + shaft2) / inertia[3] * divisor;
        real next = omega * cosine * divisor;
        cosine = -omega * sine * divisor;
        sine = next;
    }
}

static real horner(const real *c, int n, real x)
{
    real p = c[n];
    for (int k = n - 1; k >= 0; --k) p = p * x + c[k];
    return p;
}

static void advance(const series_t *y, int order, real h, state_t *end)
{
    *end = y->s[order];
    for (int k = order - 1; k >= 0; --k)
        for (int i = 0; i < 4; ++i) {
            end->phi[i] = end->phi[i] * h + y->s[k].phi[i];
            end->v[i] = end->v[i] * h + y->s[k].v[i];
        }
}

typedef struct {
    const real *c;           /* the polynomial in the working precision, argument in seconds */
    double scaled[MAX_ORDER + 1]; /* the same in double, argument scaled to [0, 1] */
    int n;
    real h;
    double bound1, bound2;   /* of the first and second derivative on [0, 1] */
    bool first_only;
    int count, undecided;
    real root[MAX_ROOTS];
} search_t;

static real polish(const search_t *s, real a, real b)
{
    real fa = horner(s->c, s->n, a), x = (a + b) / 2;
    for (int i = 0; i < 200; ++i) {
        real f = s->c[s->n], df = 0;
        for (int k = s->n - 1; k >= 0; --k) { df = df * x + f; f = f * x + s->c[k]; }
        if (f == 0) return x;
        if ((f > 0) == (fa > 0)) a = x; else b = x;
        real next = df != 0 ? x - f / df : (a + b) / 2;
        if (!(next > a && next < b)) next = (a + b) / 2;
        if (FABS(next - x) <= 2 * EPS * s->h) return next;
        x = next;
    }
    return x;
}

static void isolate(search_t *s, double a, double b, int depth)
{
    if (s->first_only && s->count > 0) return;
    double m = 0.5 * (a + b), r = 0.5 * (b - a), p = s->scaled[s->n], dp = 0.0;
    for (int k = s->n - 1; k >= 0; --k) { dp = dp * m + p; p = p * m + s->scaled[k]; }
    double slope = fmin(s->bound1, fabs(dp) + r * s->bound2);
    if (fabs(p) > 1.001 * r * slope) return;
    if (fabs(dp) > 1.001 * r * s->bound2) {
        real xa = a * s->h, xb = b * s->h;
        real fa = horner(s->c, s->n, xa), fb = horner(s->c, s->n, xb);
        if ((fa > 0) != (fb > 0)) {
            if (s->count == MAX_ROOTS) { fprintf(stderr, "too many roots in a step\n"); exit(1); }
            s->root[s->count++] = polish(s, xa, xb);
        }
        return;
    }
    if (depth == 48) { ++s->undecided; return; }
    isolate(s, a, m, depth + 1);
    isolate(s, m, b, depth + 1);
}

/* Roots of sum c_k x^k in (0, h], ascending. */
static void find_roots(search_t *s, const real *c, int n, real h, bool first_only)
{
    s->c = c; s->n = n; s->h = h; s->first_only = first_only;
    s->count = s->undecided = 0;
    s->bound1 = s->bound2 = 0.0;
    real power = 1;
    for (int k = 0; k <= n; ++k) {
        s->scaled[k] = (double)(c[k] * power);
        power *= h;
        s->bound1 += k * fabs(s->scaled[k]);
        s->bound2 += (double)k * (k - 1) * fabs(s->scaled[k]);
    }
    isolate(s, 0.0, 1.0, 0);
}

/* First exit from the contact state in (0, h]; returns the new state, or the old one when there is no exit. */
static int first_exit(const series_t *y, int order, int side, int touched, real h, real *t_exit, int *level, long *undecided)
{
    int new_side = side;
    *t_exit = h;
    for (int boundary = 0; boundary <= 1; ++boundary) { /* 0: d = 0, 1: d = -backlash */
        if ((side > 0 && boundary == 1) || (side < 0 && boundary == 0)) continue;
        real c[MAX_ORDER + 1];
        int n = order;
        memcpy(c, y->d, sizeof(real) * (order + 1));
        if (boundary == 1) c[0] += backlash;
        if (touched == boundary) { /* the motion starts on this boundary: divide its root at zero out */
            memmove(c, c + 1, sizeof(real) * order);
            --n;
        }
        search_t s;
        find_roots(&s, c, n, h, true);
        *undecided += s.undecided;
        if (s.count > 0 && s.root[0] < *t_exit) {
            *t_exit = s.root[0];
            *level = boundary;
            new_side = side != 0 ? 0 : (boundary == 0 ? 1 : -1);
        }
    }
    return new_side;
}

static void run(bool p2, double rpm, int order, double reach, FILE *out, long *events, long *undecided)
{
    const real t_end = p2 ? R(0.2) : R(0.3), t_from = R(0.25);
    const real omega = teeth * PI * (real)rpm / 30;
    static series_t y;
    /* Static equilibrium: the torque goes through both shafts and the mesh. */
    real twist = torque / shaft, closing = torque / (mesh * radius * radius);
    state_t now = {{closing / 2 + twist, closing / 2, -closing / 2, -closing / 2 - twist}, {0, 0, 0, 0}};
    real t = 0;
    int side = 1, touched = -1, grid = 0;
    while (t < t_end) {
        real h = (real)(reach / (side != 0 ? fastest_contact : fastest_gap));
        bool last = t + h >= t_end;
        if (last) h = t_end - t;
        expand(&now, t, omega, side, order, &y);
        real t_exit;
        int level = -1;
        int new_side = first_exit(&y, order, side, touched, h, &t_exit, &level, undecided);
        bool event = new_side != side;
        if (p2) {
            for (; grid <= 2000; ++grid) {
                real x = t_end * grid / 2000 - t;
                if (x > t_exit && !(last && !event)) break;
                fprintf(out, "d "); print_real(out, t + x);
                fprintf(out, " "); print_real(out, horner(y.d, order, x));
                fprintf(out, "\n");
            }
        } else if (t + t_exit >= t_from) {
            real slope[MAX_ORDER + 1];
            for (int k = 0; k < order; ++k) slope[k] = (k + 1) * y.d[k + 1];
            search_t s;
            find_roots(&s, slope, order - 1, t_exit, false);
            *undecided += s.undecided;
            for (int i = 0; i < s.count; ++i) {
                if (t + s.root[i] < t_from) continue;
                real curvature = 0;
                for (int k = order - 1; k >= 1; --k) curvature = curvature * s.root[i] + k * slope[k];
                fprintf(out, "x %.17g ", rpm); print_real(out, t + s.root[i]);
                fprintf(out, " "); print_real(out, horner(y.d, order, s.root[i]));
                fprintf(out, " %d\n", curvature < 0 ? 1 : -1);
            }
        }
        advance(&y, order, t_exit, &now);
        t = last && !event ? t_end : t + t_exit;
        touched = level;
        if (event) {
            ++*events;
            if (p2) {
                fprintf(out, "e "); print_real(out, t);
                fprintf(out, " %d %d\n", side, new_side);
            }
        }
        side = new_side;
    }
}

int main(int argc, char **argv)
{
    if (argc != 8) { fprintf(stderr, "usage: reference p2|p3 FIRST LAST STEP ORDER REACH OUTPUT\n"); return 2; }
    bool p2 = strcmp(argv[1], "p2") == 0;
    double first = atof(argv[2]), last = atof(argv[3]), step = atof(argv[4]), reach = atof(argv[6]);
    int order = atoi(argv[5]);
    if (order < 4 || order > MAX_ORDER || !(step > 0) || !(reach > 0)) { fprintf(stderr, "bad argument\n"); return 2; }
    FILE *out = fopen(argv[7], "w");
    if (!out) { perror(argv[7]); return 1; }
    long events = 0, undecided = 0;
    int speeds = (int)floor((last - first) / step + 0.5) + 1;
    for (int i = 0; i < speeds; ++i) run(p2, first + i * step, order, reach, out, &events, &undecided);
    fprintf(out, "# cpu %.6f\n# events %ld\n# undecided %ld\n", (double)clock() / CLOCKS_PER_SEC, events, undecided);
    if (fclose(out) != 0) { perror(argv[7]); return 1; }
    return 0;
}
