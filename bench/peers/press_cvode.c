/* Peer: the vibropress by CVODE (Adams, fixed-point iteration) with root finding at every change of contact.
 *
 * Standard input, numbers only: angular frequency and amplitude of the exciter (on coordinate 1), tolerance, contact stiffness, then
 * mass (9), constant force (9), K (9,9), B (9,9), gap rows (6,9), clearance (6), closed at the start (6), positions (9), number of
 * output times, these. Standard output: processor time, events, and coordinate 7 at each time. */
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <time.h>

enum { N = 9, C = 6 };
typedef struct {
   double omega, amplitude, tolerance, kc, mass[N], force[N], k[N][N], b[N][N], w[C][N], clearance[C];
   int closed[C];
} press_t;

static double number(void) {
   double value;
   if (scanf("%lf", &value) != 1) exit(2);
   return value;
}

static void numbers(double *to, int n) {
   for (int i = 0; i < n; i++) to[i] = number();
}

static int gaps(double t, N_Vector state, double *gap, void *data) {
   const press_t *p = data;
   const double *y = N_VGetArrayPointer(state);
   (void)t;
   for (int j = 0; j < C; j++) {
      gap[j] = p->clearance[j];
      for (int i = 0; i < N; i++) gap[j] += p->w[j][i] * y[i];
   }
   return 0;
}

static int slope(double t, N_Vector state, N_Vector rate, void *data) {
   const press_t *p = data;
   const double *y = N_VGetArrayPointer(state);
   double *f = N_VGetArrayPointer(rate), gap[C];
   gaps(t, state, gap, data);
   for (int i = 0; i < N; i++) {
      double sum = p->force[i];
      for (int j = 0; j < N; j++) sum -= p->k[i][j] * y[j] + p->b[i][j] * y[N + j];
      for (int j = 0; j < C; j++)
         if (p->closed[j]) sum -= p->kc * p->w[j][i] * gap[j];
      if (i == 1) sum += p->amplitude * sin(p->omega * t);
      f[i] = y[N + i];
      f[N + i] = sum / p->mass[i];
   }
   return 0;
}

int main(void) {
   static press_t p;
   p.omega = number(), p.amplitude = number(), p.tolerance = number(), p.kc = number();
   numbers(p.mass, N), numbers(p.force, N), numbers(&p.k[0][0], N * N), numbers(&p.b[0][0], N * N);
   numbers(&p.w[0][0], C * N), numbers(p.clearance, C);
   for (int j = 0; j < C; j++) p.closed[j] = number() > 0.5;
   SUNContext context;
   if (SUNContext_Create(NULL, &context)) return 1;
   N_Vector y = N_VNew_Serial(2 * N, context);
   N_VConst(0.0, y);
   numbers(N_VGetArrayPointer(y), N);
   int count = number(), events = 0;
   double *times = malloc(count * sizeof *times), *height = malloc(count * sizeof *height), t = 0.0;
   numbers(times, count);
   void *cvode = CVodeCreate(CV_ADAMS, context);
   SUNNonlinearSolver fixed = SUNNonlinSol_FixedPoint(y, 0, context);
   if (CVodeInit(cvode, slope, 0.0, y) || CVodeSStolerances(cvode, p.tolerance, 1e-6 * p.tolerance) ||
       CVodeSetUserData(cvode, &p) || CVodeSetNonlinearSolver(cvode, fixed) || CVodeRootInit(cvode, C, gaps) ||
       CVodeSetMaxNumSteps(cvode, 100000000))
      return 1;
   clock_t begun = clock();
   for (int i = 0; i < count; i++) {
      int flag;
      while ((flag = CVode(cvode, times[i], y, &t, CV_NORMAL)) == CV_ROOT_RETURN) {
         int found[C];
         CVodeGetRootInfo(cvode, found);
         for (int j = 0; j < C; j++) {
            if (!found[j]) continue;
            p.closed[j] = found[j] < 0;
            events++;
         }
         if (CVodeReInit(cvode, t, y)) return 1;
      }
      if (flag < 0) return 1;
      height[i] = N_VGetArrayPointer(y)[7];
   }
   printf("%.6e %d\n", (double)(clock() - begun) / CLOCKS_PER_SEC, events);
   for (int i = 0; i < count; i++) printf("%.17e\n", height[i]);
   return 0;
}
