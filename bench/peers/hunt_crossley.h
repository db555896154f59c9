/* A driven oscillator between Hunt-Crossley stops for the compiled peers, in the form of gear_pair.h.
 *
 * y = (x, x'); d = x - clearance; contact: 1 on the upper stop (d > 0), 0 in flight, -1 on the lower one (d < -backlash).
 * With the deformation p of a stop its force is k p^(3/2) (1 + 3/2 alpha p'). `full` and `relative` are the same. SI units.
 */
#ifndef HUNT_CROSSLEY_H
#define HUNT_CROSSLEY_H

#include <math.h>
#include <stdbool.h>

static const double mass = 1.0, spring = 400.0, damper = 0.4, clearance = 5e-3, backlash = 1e-2;
static const double stop = 2e7, hysteresis = 0.2, load = 20.0;

static const double p2_end = 20.0, p3_from = 1.0, p3_end = 2.0;
enum { p2_points = 2001, full_size = 2, relative_size = 2 };

/* Here the circular frequency of the load, rad/s, of a "speed" in rpm. */
static inline double mesh_frequency(double rpm)
{
    return acos(-1.0) * rpm / 30.0;
}

static const double radius = 1.0, error_sine = 0.0;

static inline double closing_rate(bool relative, const double *y)
{
    (void)relative;
    return y[1];
}

static inline double deformation(bool relative, double omega, double t, const double *y)
{
    (void)relative; (void)omega; (void)t;
    return y[0] - clearance;
}

static inline double deformation_rate(bool relative, double omega, double t, const double *y)
{
    (void)relative; (void)omega; (void)t;
    return y[1];
}

/* Beyond its edge a method looks a little: there the force goes on as the odd function. */
static inline double push(double p, double rate)
{
    return (p > 0 ? p : -p) * stop * (p > 0 ? sqrt(p) : -sqrt(-p)) * (1.0 + 1.5 * hysteresis * rate);
}

static inline void equations(bool relative, double omega, int side, double t, const double *y, double *f)
{
    double force = 0.0;
    if (side > 0) force = push(deformation(relative, omega, t, y), y[1]);
    else if (side < 0) force = -push(-backlash - deformation(relative, omega, t, y), -y[1]);
    f[0] = y[1];
    f[1] = (load * cos(omega * t) - spring * y[0] - damper * y[1] - force) / mass;
}

static inline void start_at_rest(bool relative, double *y)
{
    (void)relative;
    y[0] = y[1] = 0.0;
}

static inline double scale(bool relative, int i)
{
    (void)relative;
    return i == 0 ? 1e-3 : 1.0;
}

#endif
