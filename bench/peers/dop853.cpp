// Peer: DOP853 of Hairer and Wanner with its dense output, as modern Fortran (J. Williams), from the sources of numbalsoda.
//
// Setting dop853:FORM:RTOL. Equations in Fortran, called by the method directly (dop853_c.f90). Events are located on the
// dense output inside `solout`, which then ends the integration; it starts again with the step size that was last used in
// that contact. numbalsoda's own `solve_ivp` is not used: it finds events to 1e-8 s only, and takes one tolerance for all.
#include <algorithm>

#include "follow.hpp"

extern "C" {
typedef int (*step_function)(void *context, int nr, double t, const double *y);
void *dop853_new(void);
void dop853_free(void *handle);
int dop853_run(void *handle, int n, double omega, double stiffness, double shift, double *t, double *y, double t_end,
               const double *rtol, const double *atol, double *h, step_function on_step, void *context);
double dop853_dense(void *handle, int i, double t);
}

template <bool relative> struct context_t {
    motion_t<relative> &m;
    void *handle;
    double end;
    double *usual;

    double d(double t) const { return m.d_of(t, dense(t, false).y); }
    double rate(double t) const { return m.rate_of(t, dense(t, true).y); }
    void state(double t, double *y) const
    {
        for (int i = 0; i < m.size; ++i) y[i] = dop853_dense(handle, i + 1, t);
    }

private:
    struct partial_t {
        double y[full_size];
    };
    // Only the components that the mesh deformation needs, or its rate.
    partial_t dense(double t, bool rates) const
    {
        partial_t at;
        int half = m.size / 2, i = 1 + (rates ? half : 0);
        at.y[i] = dop853_dense(handle, i + 1, t);
        if (!relative) at.y[i + 1] = dop853_dense(handle, i + 2, t);
        return at;
    }
};

template <bool relative> static int on_step(void *data, int, double t, const double *y)
{
    auto &context = *static_cast<context_t<relative> *>(data);
    if (t < context.end) *context.usual = t - context.m.t;
    return context.m.take(t, y, context) ? 0 : 1;
}

template <bool relative> static void follow(motion_t<relative> &m, double rtol, double end)
{
    double usual[3] = {1e-6, 1e-6, 1e-6}, rtols[full_size], atols[full_size], y[full_size];
    for (int i = 0; i < m.size; ++i) {
        rtols[i] = rtol;
        atols[i] = rtol * scale(relative, i);
    }
    void *handle = dop853_new();
    context_t<relative> context{m, handle, end, nullptr};
    while (m.t < end) {
        context.usual = &usual[m.side + 1];
        double t = m.t, h = std::min(*context.usual, end - t);
        std::copy(m.y, m.y + m.size, y);
        int code = dop853_run(handle, m.size, m.omega, m.side == 0 ? 0.0 : mesh, m.side < 0 ? backlash : 0.0, &t, y, end, rtols,
                              atols, &h, on_step<relative>, &context);
        if (code < 0) {
            std::fprintf(stderr, "dop853 stopped with %d\n", code);
            std::exit(1);
        }
    }
    dop853_free(handle);
}

int main(int argc, char **argv)
{
    return peer_main(argc, argv, [](auto &m, const std::string &, double rtol, double end) { follow(m, rtol, end); });
}
