// Peer: GSL's gsl_odeiv2, Prince-Dormand 8(9) (rk8pd) or another of its one-step methods.
//
// Setting METHOD:FORM:RTOL; METHOD is rk8pd, rkf45 or rkck. GSL has no dense output: the step of an event is taken anew up
// to it. After a change of contact the step size goes on that was last used in that contact.
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <algorithm>

#include "follow.hpp"

template <bool relative> static int right_hand_side(double t, const double y[], double f[], void *data)
{
    static_cast<const motion_t<relative> *>(data)->rhs(t, y, f);
    return GSL_SUCCESS;
}

static void check(int status)
{
    if (status == GSL_SUCCESS) return;
    std::fprintf(stderr, "GSL: %s\n", gsl_strerror(status));
    std::exit(1);
}

static const gsl_odeiv2_step_type *method_named(const std::string &name)
{
    if (name == "rk8pd") return gsl_odeiv2_step_rk8pd;
    if (name == "rkf45") return gsl_odeiv2_step_rkf45;
    if (name == "rkck") return gsl_odeiv2_step_rkck;
    std::fprintf(stderr, "unknown method %s\n", name.c_str());
    std::exit(2);
}

template <bool relative> static void follow(motion_t<relative> &m, const std::string &method, double rtol, double end)
{
    constexpr int size = motion_t<relative>::size;
    double scales[size], y1[size], usual[3] = {1e-6, 1e-6, 1e-6};
    for (int i = 0; i < size; ++i) scales[i] = scale(relative, i);
    const gsl_odeiv2_step_type *type = method_named(method);
    gsl_odeiv2_step *step = gsl_odeiv2_step_alloc(type, size), *again = gsl_odeiv2_step_alloc(type, size);
    gsl_odeiv2_control *control = gsl_odeiv2_control_scaled_new(rtol, rtol, 1.0, 0.0, scales, size);
    gsl_odeiv2_evolve *evolve = gsl_odeiv2_evolve_alloc(size);
    gsl_odeiv2_system system = {right_hand_side<relative>, nullptr, size, &m};
    while (m.t < end) {
        double t1 = m.t, &h = usual[m.side + 1], next = h;
        std::copy(m.y, m.y + size, y1);
        check(gsl_odeiv2_evolve_apply(evolve, control, step, &system, &t1, end, &next, y1));
        if (t1 < end) h = next;
        auto redo = [&](double t, double *y) {
            double error[size];
            std::copy(m.y, m.y + size, y);
            check(gsl_odeiv2_step_apply(again, m.t, t - m.t, y, error, nullptr, nullptr, &system));
        };
        if (m.take(t1, y1, refined_t<motion_t<relative>, decltype(redo)>(m, t1, y1, redo))) {
            gsl_odeiv2_evolve_reset(evolve);
            gsl_odeiv2_step_reset(step);
        }
    }
    gsl_odeiv2_evolve_free(evolve);
    gsl_odeiv2_control_free(control);
    gsl_odeiv2_step_free(again);
    gsl_odeiv2_step_free(step);
}

int main(int argc, char **argv)
{
    gsl_set_error_handler_off();
    return peer_main(argc, argv, [](auto &m, const std::string &method, double rtol, double end) {
        follow(m, method, rtol, end);
    });
}
