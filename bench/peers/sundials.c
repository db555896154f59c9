/* Peer: SUNDIALS CVODE (Adams, BDF) and ARKODE (explicit Runge-Kutta) with root finding.
 *
 * usage: sundials p2|p3 METHOD:FORM:TREATMENT:RTOL FIRST LAST STEP OUTPUT
 *   METHOD     adams, bdf (CVODE); dopri5, cashkarp, verner8, fehlberg13 (ARKODE ERKStep)
 *   FORM       full, relative (gear_pair.h)
 *   TREATMENT  events   stop at every change of contact, restart with the new contact state
 *              through  integrate over the kinks of the mesh force, leaving them to the step size control
 */
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <time.h>

#ifdef HUNT_CROSSLEY
#include "hunt_crossley.h"
#else
#include "gear_pair.h"
#endif

typedef struct {
    double omega;
    bool through; /* contact follows from d, else from side */
    int side;
    bool relative;
} model_t;

static void check(int flag, const char *call)
{
    if (flag < 0) {
        fprintf(stderr, "%s failed with %d\n", call, flag);
        exit(1);
    }
}

static double gap(double t, const double *y, const model_t *m)
{
    return deformation(m->relative, m->omega, t, y);
}

static int contact(double d, const model_t *m)
{
    if (!m->through) return m->side;
    return d > 0 ? 1 : (d < -backlash ? -1 : 0);
}

static int rhs(double t, N_Vector state, N_Vector rate, void *data)
{
    const model_t *m = data;
    const double *y = N_VGetArrayPointer(state);
    int side = m->through ? contact(gap(t, y, m), m) : m->side;
    equations(m->relative, m->omega, side, t, y, N_VGetArrayPointer(rate));
    return 0;
}

#if !defined HUNT_CROSSLEY && !defined HERTZ
static int jacobian(double t, N_Vector state, N_Vector rate, SUNMatrix jac, void *data, N_Vector w1, N_Vector w2, N_Vector w3)
{
    (void)rate; (void)w1; (void)w2; (void)w3;
    const model_t *m = data;
    bool open = contact(gap(t, N_VGetArrayPointer(state), m), m) == 0;
    double stiffness = open ? 0.0 : mesh * radius * radius;
    double k[4][4] = {{shaft, -shaft, 0, 0},
                      {-shaft, shaft + stiffness, -stiffness, 0},
                      {0, -stiffness, shaft + stiffness, -shaft},
                      {0, 0, -shaft, shaft}};
    double b[4][4] = {{shaft, -shaft, 0, 0}, {-shaft, shaft, 0, 0}, {0, 0, shaft, -shaft}, {0, 0, -shaft, shaft}};
    int half = m->relative ? 2 : 4;
    if (m->relative) k[1][1] += stiffness;
    SUNMatZero(jac);
    for (int i = 0; i < half; ++i) {
        SM_ELEMENT_D(jac, i, half + i) = 1.0;
        for (int j = 0; j < half; ++j) {
            SM_ELEMENT_D(jac, half + i, j) = -k[i][j] / inertia[i];
            SM_ELEMENT_D(jac, half + i, half + j) = -damping_factor * b[i][j] / inertia[i];
        }
    }
    return 0;
}

#endif

/* Roots: rate of d (extrema) when asked; then the two boundaries of the gap. */
static int roots_events(double t, N_Vector state, double *g, void *data)
{
    double d = gap(t, N_VGetArrayPointer(state), data);
    g[0] = d;
    g[1] = d + backlash;
    return 0;
}

static int roots_extrema(double t, N_Vector state, double *g, void *data)
{
    const model_t *m = data;
    g[0] = deformation_rate(m->relative, m->omega, t, N_VGetArrayPointer(state));
    return 0;
}

static int roots_all(double t, N_Vector state, double *g, void *data)
{
    roots_extrema(t, state, g, data);
    return roots_events(t, state, g + 1, data);
}

typedef struct {
    void *memory;
    bool erk;
    model_t *model;
    N_Vector state;
} solver_t;

static void restart(solver_t *s, double t)
{
    if (s->erk) check(ERKStepReset(s->memory, t, s->state), "ERKStepReset");
    else check(CVodeReInit(s->memory, t, s->state), "CVodeReInit");
}

static void set_roots(solver_t *s, bool extrema)
{
    bool events = !s->model->through;
    int count = (extrema ? 1 : 0) + (events ? 2 : 0);
    int (*g)(double, N_Vector, double *, void *) = !extrema ? roots_events : (events ? roots_all : roots_extrema);
    if (s->erk) check(ERKStepRootInit(s->memory, count, g), "ERKStepRootInit");
    else check(CVodeRootInit(s->memory, count, g), "CVodeRootInit");
}

static void set_stop(solver_t *s, double t)
{
    if (s->erk) check(ERKStepSetStopTime(s->memory, t), "ERKStepSetStopTime");
    else check(CVodeSetStopTime(s->memory, t), "CVodeSetStopTime");
}

/* Integrate to t_to; write extrema when out is given and contact changes when log is given. */
static void integrate(solver_t *s, double *t, double t_to, bool extrema, double rpm, FILE *out, FILE *log, long *events)
{
    while (*t < t_to) {
        int flag = s->erk ? ERKStepEvolve(s->memory, t_to, s->state, t, ARK_NORMAL)
                          : CVode(s->memory, t_to, s->state, t, CV_NORMAL);
        check(flag, "step");
        if (flag != CV_ROOT_RETURN) continue;
        int found[3] = {0, 0, 0};
        check(s->erk ? ERKStepGetRootInfo(s->memory, found) : CVodeGetRootInfo(s->memory, found), "root info");
        if (extrema && found[0] != 0)
            fprintf(out, "x %.17g %.17g %.17g %d\n", rpm, *t, gap(*t, N_VGetArrayPointer(s->state), s->model),
                    -found[0]);
        const int *boundary = extrema ? found + 1 : found;
        if (s->model->through || (boundary[0] == 0 && boundary[1] == 0)) continue;
        int side = s->model->side;
        if (boundary[0] != 0) s->model->side = boundary[0] > 0 ? 1 : 0;
        else s->model->side = boundary[1] > 0 ? 0 : -1;
        if (s->model->side == side) continue;
        ++*events;
        if (log) fprintf(log, "e %.17g %d %d\n", *t, side, s->model->side);
        restart(s, *t);
    }
}

int main(int argc, char **argv)
{
    if (argc != 7) {
        fprintf(stderr, "usage: sundials p2|p3 METHOD:FORM:TREATMENT:RTOL FIRST LAST STEP OUTPUT\n");
        return 2;
    }
    bool p2 = strcmp(argv[1], "p2") == 0;
    char method[32], form[32], treatment[32];
    double rtol, first = atof(argv[3]), last = atof(argv[4]), step = atof(argv[5]);
    if (sscanf(argv[2], "%31[^:]:%31[^:]:%31[^:]:%lf", method, form, treatment, &rtol) != 4 || !(step > 0)) {
        fprintf(stderr, "bad setting %s\n", argv[2]);
        return 2;
    }
    bool bdf = strcmp(method, "bdf") == 0, erk = !bdf && strcmp(method, "adams") != 0, relative = strcmp(form, "relative") == 0;
    int size = relative ? relative_size : full_size;
    ARKODE_ERKTableID table = ARKODE_ERK_NONE;
    if (strcmp(method, "dopri5") == 0) table = ARKODE_DORMAND_PRINCE_7_4_5;
    if (strcmp(method, "cashkarp") == 0) table = ARKODE_CASH_KARP_6_4_5;
    if (strcmp(method, "verner8") == 0) table = ARKODE_VERNER_8_5_6;
    if (strcmp(method, "fehlberg13") == 0) table = ARKODE_FEHLBERG_13_7_8;
    if (erk && table == ARKODE_ERK_NONE) { fprintf(stderr, "unknown method %s\n", method); return 2; }
    FILE *out = fopen(argv[6], "w");
    if (!out) { perror(argv[6]); return 1; }

    clock_t start = clock();
    SUNContext context;
    check(SUNContext_Create(NULL, &context), "SUNContext_Create");
    N_Vector state = N_VNew_Serial(size, context), tolerance = N_VNew_Serial(size, context);
    double *y = N_VGetArrayPointer(state), *atol = N_VGetArrayPointer(tolerance);
    for (int i = 0; i < size; ++i) atol[i] = rtol * scale(relative, i);
    SUNMatrix matrix = NULL;
    SUNLinearSolver linear = NULL;
    SUNNonlinearSolver nonlinear = NULL;
    if (bdf) {
        matrix = SUNDenseMatrix(size, size, context);
        linear = SUNLinSol_Dense(state, matrix, context);
    } else if (!erk) {
        nonlinear = SUNNonlinSol_FixedPoint(state, 0, context);
    }

    long events = 0;
    int speeds = (int)floor((last - first) / step + 0.5) + 1;
    for (int i = 0; i < speeds; ++i) {
        double rpm = first + i * step, t = 0.0;
        model_t model = {mesh_frequency(rpm), strcmp(treatment, "through") == 0, 1, relative};
        start_at_rest(relative, y);
        solver_t s = {NULL, erk, &model, state};
        if (erk) {
            s.memory = ERKStepCreate(rhs, t, state, context);
            check(ERKStepSetUserData(s.memory, &model), "ERKStepSetUserData");
            check(ERKStepSVtolerances(s.memory, rtol, tolerance), "ERKStepSVtolerances");
            check(ERKStepSetTableNum(s.memory, table), "ERKStepSetTableNum");
            check(ERKStepSetMaxNumSteps(s.memory, 100000000), "ERKStepSetMaxNumSteps");
            check(ERKStepSetInterpolantDegree(s.memory, 5), "ERKStepSetInterpolantDegree");
        } else {
            s.memory = CVodeCreate(bdf ? CV_BDF : CV_ADAMS, context);
            check(CVodeInit(s.memory, rhs, t, state), "CVodeInit");
            check(CVodeSetUserData(s.memory, &model), "CVodeSetUserData");
            check(CVodeSVtolerances(s.memory, rtol, tolerance), "CVodeSVtolerances");
            check(CVodeSetMaxNumSteps(s.memory, 100000000), "CVodeSetMaxNumSteps");
            if (bdf) {
                check(CVodeSetLinearSolver(s.memory, linear, matrix), "CVodeSetLinearSolver");
#if !defined HUNT_CROSSLEY && !defined HERTZ
                check(CVodeSetJacFn(s.memory, jacobian), "CVodeSetJacFn");
#endif
            } else {
                check(CVodeSetNonlinearSolver(s.memory, nonlinear), "CVodeSetNonlinearSolver");
            }
        }
        if (!model.through) set_roots(&s, false);
        if (p2) {
            set_stop(&s, p2_end);
            for (int j = 0; j < p2_points; ++j) {
                double t_grid = p2_end * j / (p2_points - 1);
                integrate(&s, &t, t_grid, false, rpm, NULL, out, &events);
                fprintf(out, "d %.17g %.17g\n", t, gap(t, y, &model));
            }
        } else {
            set_stop(&s, p3_from);
            integrate(&s, &t, p3_from, false, rpm, NULL, NULL, &events);
            restart(&s, t);
            set_roots(&s, true);
            set_stop(&s, p3_end);
            integrate(&s, &t, p3_end, true, rpm, out, NULL, &events);
        }
        if (erk) ERKStepFree(&s.memory);
        else CVodeFree(&s.memory);
    }
    fprintf(out, "# cpu %.6f\n", (double)(clock() - start) / CLOCKS_PER_SEC);
    if (strcmp(treatment, "through") != 0) fprintf(out, "# events %ld\n", events);
    N_VDestroy(state);
    N_VDestroy(tolerance);
    if (bdf) { SUNLinSolFree(linear); SUNMatDestroy(matrix); }
    if (nonlinear) SUNNonlinSolFree(nonlinear);
    SUNContext_Free(&context);
    if (fclose(out) != 0) { perror(argv[6]); return 1; }
    return 0;
}
