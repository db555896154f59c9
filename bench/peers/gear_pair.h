/* The torsional gear pair for the compiled peers, as first-order equations in two forms.
 *
 *   full      y = (phi_1 .. phi_4, their rates): four inertias, as given
 *   relative  y = (a, b, a', b') with a = phi_1 - phi_4 and b = phi_2 - phi_3: what remains when the symmetry of this
 *             pair (equal inertias, shafts and radii) is used by hand
 *
 * The mesh deformation is d = radius * closing + error_sine * sin(omega t). Contact: 1 on the working flank (d > 0), 0 in
 * the backlash, -1 on the back flank (d < -backlash). SI units. With HERTZ the mesh is that of two curved flanks, k d^(3/2).
 */
#ifndef GEAR_PAIR_H
#define GEAR_PAIR_H

#include <math.h>
#include <stdbool.h>

static const double inertia[4] = {0.1, 0.00794, 0.00794, 0.1};
static const double shaft = 6.2905e4, damping_factor = 5e-4, radius = 0.08, mesh = 8e8, backlash = 1e-4;
static const double error_sine = 5e-5, teeth = 40.0, torque = 100.0;

static const double p2_end = 0.2, p3_from = 0.25, p3_end = 0.3;
enum { p2_points = 2001, full_size = 8, relative_size = 4 };

/* Circular tooth frequency, rad/s. */
static inline double mesh_frequency(double rpm)
{
    return teeth * acos(-1.0) * rpm / 30.0;
}

/* Where the deformation and its rate stand in the state: radius * (y[i] - y[i+1]), or radius * y[i]. */
static inline double closing(bool relative, const double *y)
{
    return relative ? y[1] : y[1] - y[2];
}

static inline double closing_rate(bool relative, const double *y)
{
    return relative ? y[3] : y[5] - y[6];
}

static inline double deformation(bool relative, double omega, double t, const double *y)
{
    return radius * closing(relative, y) + error_sine * sin(omega * t);
}

static inline double deformation_rate(bool relative, double omega, double t, const double *y)
{
    return radius * closing_rate(relative, y) + error_sine * omega * cos(omega * t);
}

#ifdef HERTZ
static const double hertz = 6.4e11; /* N/m^(3/2): as stiff as the linear mesh at the static load */

static inline double mesh_force(double d, int side)
{
    double p = side > 0 ? d : -backlash - d, force = hertz * p * sqrt(fabs(p));
    return side == 0 ? 0.0 : (side > 0 ? force : -force);
}
#else
static inline double mesh_force(double d, int side)
{
    return side == 0 ? 0.0 : (side > 0 ? mesh * d : mesh * (d + backlash));
}
#endif

static inline void full_equations(double force, const double *y, double *f)
{
    double shaft1 = shaft * (y[0] - y[1] + damping_factor * (y[4] - y[5]));
    double shaft2 = shaft * (y[2] - y[3] + damping_factor * (y[6] - y[7]));
    for (int i = 0; i < 4; ++i) f[i] = y[4 + i];
    f[4] = (torque - shaft1) / inertia[0];
    f[5] = (shaft1 - radius * force) / inertia[1];
    f[6] = (radius * force - shaft2) / inertia[2];
    f[7] = (shaft2 - torque) / inertia[3];
}

static inline void relative_equations(double force, const double *y, double *f)
{
    double both = shaft * (y[0] - y[1] + damping_factor * (y[2] - y[3]));
    f[0] = y[2];
    f[1] = y[3];
    f[2] = (2.0 * torque - both) / inertia[0];
    f[3] = (both - 2.0 * radius * force) / inertia[1];
}

static inline void equations(bool relative, double omega, int side, double t, const double *y, double *f)
{
    double force = side == 0 ? 0.0 : mesh_force(deformation(relative, omega, t, y), side);
    if (relative) relative_equations(force, y, f);
    else full_equations(force, y, f);
}

/* Static equilibrium under the torque, at rest. */
static inline void start_at_rest(bool relative, double *y)
{
    double twist = torque / shaft, gap = torque / (mesh * radius * radius);
#ifdef HERTZ
    gap = pow(torque / (radius * hertz), 2.0 / 3.0) / radius;
#endif
    double phi[4] = {gap / 2 + twist, gap / 2, -gap / 2, -gap / 2 - twist};
    for (int i = 0; i < (relative ? relative_size : full_size); ++i) y[i] = 0.0;
    if (relative) {
        y[0] = phi[0] - phi[3];
        y[1] = phi[1] - phi[2];
    } else {
        for (int i = 0; i < 4; ++i) y[i] = phi[i];
    }
}

/* Sizes of the motion, rad and rad/s, by which a relative tolerance becomes an absolute one. */
static inline double scale(bool relative, int i)
{
    return i < (relative ? relative_size : full_size) / 2 ? 1e-3 : 1.0;
}

#endif
