// Peer: Boost.odeint, compiled with the equations into one program.
//
// Setting METHOD:FORM:RTOL; METHOD is
//   dopri5       Dormand-Prince 5(4) with its dense output, on which events are located
//   fehlberg78   Fehlberg 8(7), which has none: the step of an event is taken anew up to it
// After a change of contact the step size goes on that was last used in that contact.
#include <array>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/dense_output_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>

#include "follow.hpp"

namespace odeint = boost::numeric::odeint;

static const double first_step = 1e-6;

// Largest error of a component over its tolerance, as odeint's own checker, with a size for each component.
template <bool relative, class State> struct checker_t {
    typedef double value_type;
    typedef odeint::array_algebra algebra_type;
    typedef odeint::default_operations operations_type;
    double rtol = 1e-6;

    template <class Deriv, class Err, class Time>
    double error(algebra_type &, const State &x, const Deriv &, Err &err, Time) const
    {
        double largest = 0.0;
        for (size_t i = 0; i < x.size(); ++i)
            largest = std::fmax(largest, std::fabs(err[i]) / (rtol * (scale(relative, i) + std::fabs(x[i]))));
        return largest;
    }
};

template <bool relative> struct methods_t {
    static constexpr int size = motion_t<relative>::size;
    using state_t = std::array<double, size>;
    using check_t = checker_t<relative, state_t>;
    using dopri5_t = odeint::runge_kutta_dopri5<state_t, double, state_t, double, odeint::array_algebra>;
    using fehlberg_t = odeint::runge_kutta_fehlberg78<state_t, double, state_t, double, odeint::array_algebra>;
    using adjust_t = odeint::default_step_adjuster<double, double>;
    using controlled5_t = odeint::controlled_runge_kutta<dopri5_t, check_t, adjust_t>;
    using controlled78_t = odeint::controlled_runge_kutta<fehlberg_t, check_t, adjust_t>;

    static void dopri5(motion_t<relative> &m, double rtol, double end)
    {
        odeint::dense_output_runge_kutta<controlled5_t> stepper{controlled5_t(check_t{rtol})};
        double usual[3] = {first_step, first_step, first_step};
        auto rhs = [&m](const state_t &y, state_t &f, double t) { m.rhs(t, y.data(), f.data()); };
        state_t start;
        bool fresh = true;
        m.probes = 0;
        while (m.t < end) {
            double &h = usual[m.side + 1];
            if (fresh) {
                std::copy(m.y, m.y + size, start.begin());
                stepper.initialize(start, m.t, std::fmin(h, end - m.t));
            } else if (stepper.current_time() + stepper.current_time_step() > end) {
                stepper.initialize(stepper.current_state(), m.t, end - m.t);
            }
            stepper.do_step(rhs);
            double t1 = std::fabs(stepper.current_time() - end) < 1e-14 ? end : stepper.current_time();
            if (t1 < end) h = stepper.current_time() - stepper.previous_time();
            struct {
                const odeint::dense_output_runge_kutta<controlled5_t> &dense;
                const motion_t<relative> &m;
                double d(double t) { state_t y; dense.calc_state(t, y); return m.d_of(t, y.data()); }
                double rate(double t) { state_t y; dense.calc_state(t, y); return m.rate_of(t, y.data()); }
                void state(double t, double *y) { state_t x; dense.calc_state(t, x); std::copy(x.begin(), x.end(), y); }
            } step{stepper, m};
            fresh = m.take(t1, stepper.current_state().data(), step);
        }
    }

    static void fehlberg78(motion_t<relative> &m, double rtol, double end)
    {
        controlled78_t stepper(check_t{rtol});
        fehlberg_t plain;
        double usual[3] = {first_step, first_step, first_step};
        auto rhs = [&m](const state_t &y, state_t &f, double t) { m.rhs(t, y.data(), f.data()); };
        while (m.t < end) {
            state_t start, y1;
            std::copy(m.y, m.y + size, start.begin());
            double &h = usual[m.side + 1];
            double t1 = m.t, next = h;
            bool last = m.t + h >= end;
            if (last) next = end - m.t;
            y1 = start;
            while (stepper.try_step(rhs, y1, t1, next) == odeint::fail) last = false;
            if (last) t1 = end;
            else h = next;
            auto redo = [&](double t, double *y) {
                state_t x = start;
                plain.do_step(rhs, x, m.t, t - m.t);
                std::copy(x.begin(), x.end(), y);
            };
            refined_t<motion_t<relative>, decltype(redo)> step(m, t1, y1.data(), redo);
            m.take(t1, y1.data(), step);
        }
    }
};

template <bool relative> static void follow(motion_t<relative> &m, const std::string &method, double rtol, double end)
{
    if (method == "dopri5") methods_t<relative>::dopri5(m, rtol, end);
    else if (method == "fehlberg78") methods_t<relative>::fehlberg78(m, rtol, end);
    else {
        std::fprintf(stderr, "unknown method %s\n", method.c_str());
        std::exit(2);
    }
}

int main(int argc, char **argv)
{
    return peer_main(argc, argv, [](auto &m, const std::string &method, double rtol, double end) {
        follow(m, method, rtol, end);
    });
}
