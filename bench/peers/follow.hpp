// What the compiled one-step peers share: from accepted steps to changes of contact, extrema and samples of d.
//
// A method hands over each accepted step with a `Step` that knows the state anywhere inside it:
//   double d(t), rate(t)      deformation and its rate; may be an approximation, which is then polished
//   void state(t, y)          the state with the accuracy of the method
// Between two extrema of d at most one boundary of the gap is met, so a step is split at its extrema, which probes of the
// rate inside it show, and the boundary looked for in the monotone parts: two changes of contact in one step are both seen.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#ifdef HUNT_CROSSLEY
#include "hunt_crossley.h"
#else
#include "gear_pair.h"
#endif

struct extremum_t {
    double rpm, t, d;
    int kind;
};

struct result_t {
    std::vector<extremum_t> extrema;
    std::vector<double> events, sample_times, samples;
    long event_count = 0;
};

// Zero of f between a and b where its signs differ, to rounding of the abscissa (Chandrupatla 1997).
template <class F> double root(F &&f, double a, double fa, double b, double fb)
{
    double c = a, fc = fa, weight = 0.5;
    for (int i = 0; i < 100; ++i) {
        double x = a + weight * (b - a), fx = f(x);
        if ((fx > 0) == (fa > 0)) {
            c = a;
            fc = fa;
        } else {
            c = b;
            b = a;
            fc = fb;
            fb = fa;
        }
        a = x;
        fa = fx;
        double best = std::fabs(fa) < std::fabs(fb) ? a : b;
        double least = std::numeric_limits<double>::epsilon() * std::fabs(best) / std::fabs(b - a);
        if (least > 0.5 || fa == 0.0 || fb == 0.0) return fa == 0.0 ? a : (fb == 0.0 ? b : best);
        double xi = (a - b) / (c - b), phi = (fa - fb) / (fc - fb);
        if (phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi)
            weight = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb);
        else
            weight = 0.5;
        weight = std::fmin(1 - least, std::fmax(least, weight));
    }
    return a;
}

// Quintic through d, its rate and second derivative at both ends of a step: where to refine a step without dense output.
struct hermite_t {
    double start, length, c[6];

    hermite_t(double t0, double d0, double r0, double a0, double t1, double d1, double r1, double a1)
        : start(t0), length(t1 - t0)
    {
        double h = length;
        double rest = d1 - d0 - h * r0 - 0.5 * h * h * a0, slope = h * (r1 - r0 - h * a0), bend = h * h * (a1 - a0);
        c[0] = d0;
        c[1] = h * r0;
        c[2] = 0.5 * h * h * a0;
        c[3] = 10 * rest - 4 * slope + 0.5 * bend;
        c[4] = -15 * rest + 7 * slope - bend;
        c[5] = 6 * rest - 3 * slope + 0.5 * bend;
    }
    double d(double t) const
    {
        double s = (t - start) / length;
        return c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))));
    }
    double rate(double t) const
    {
        double s = (t - start) / length;
        return (c[1] + s * (2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * 5 * c[5])))) / length;
    }
};

template <bool relative> class motion_t {
public:
    static constexpr int size = relative ? relative_size : full_size;

    double rpm, omega;
    int side = 1;
    bool recording = false;
    int probes = 3; // of the rate inside a step; a method of short steps does without
    double t = 0.0, y[size];

    motion_t(double speed, result_t &out) : rpm(speed), omega(mesh_frequency(speed)), result(out)
    {
        start_at_rest(relative, y);
        d_here = d_of(t, y);
        rate_here = rate_of(t, y);
    }
    void rhs(double time, const double *state, double *f) const { equations(relative, omega, side, time, state, f); }
    double d_of(double time, const double *state) const { return deformation(relative, omega, time, state); }
    double rate_of(double time, const double *state) const { return deformation_rate(relative, omega, time, state); }
    double acceleration(double time, const double *state) const
    {
        double f[size];
        rhs(time, state, f);
        return radius * closing_rate(relative, f) - error_sine * omega * omega * std::sin(omega * time);
    }
    void sample_to(double end, int points)
    {
        grid_end = end;
        grid_points = points;
    }

    // Take over a step from t to t1. True: contact changed inside it; the motion then stands there.
    template <class Step> bool take(double t1, const double *y1, Step &&step)
    {
        double d1 = d_of(t1, y1), rate1 = rate_of(t1, y1), from = t, rate_from = rate_here;
        int pieces = recording || may_leave(t1 - t, d1, rate1) ? probes + 1 : 0;
        for (int i = 1; i <= pieces; ++i) {
            double to = i == pieces ? t1 : t + (t1 - t) * i / pieces, rate_to = i == pieces ? rate1 : step.rate(to);
            if ((rate_from > 0) != (rate_to > 0)) {
                double y_ext[size], t_ext = root([&](double x) { return step.rate(x); }, from, rate_from, to, rate_to);
                step.state(t_ext, y_ext);
                polish_extremum(step, t1, t_ext, y_ext);
                double d_ext = d_of(t_ext, y_ext);
                if (leaves(d_ext) != 0) return stop(step, piece_start, d_here, t_ext, d_ext);
                if (recording) result.extrema.push_back({rpm, t_ext, d_ext, rate_from > 0 ? 1 : -1});
                piece_start = t_ext;
                d_here = d_ext;
            }
            from = to;
            rate_from = rate_to;
        }
        if (leaves(d1) != 0) return stop(step, piece_start, d_here, t1, d1);
        sample(step, t1);
        t = piece_start = t1;
        for (int i = 0; i < size; ++i) y[i] = y1[i];
        d_here = d1;
        rate_here = rate1;
        return false;
    }

private:
    result_t &result;
    double d_here, rate_here, piece_start = 0.0;
    double grid_end = 0.0;
    int grid_points = 0, grid_next = 0;

    // By which way a deformation is outside the present contact: 1 upwards, -1 downwards, 0 not.
    int leaves(double d) const
    {
        if (side < 1 && d > (side == 0 ? 0.0 : -backlash)) return 1;
        return side > -1 && d < (side == 0 ? -backlash : 0.0) ? -1 : 0;
    }
    // Whether a step can reach a boundary in between: it starts on one, or is near enough for its rates.
    bool may_leave(double h, double d1, double rate1) const
    {
        if (d_here == 0.0 || d_here == -backlash) return true;
        double reach = h * (std::fabs(rate_here) + std::fabs(rate1));
        return leaves(std::fmax(d_here, d1) + reach) > 0 || leaves(std::fmin(d_here, d1) - reach) < 0;
    }

    template <class Step> void polish_extremum(Step &step, double t1, double &t_ext, double *y_ext) const
    {
        for (int i = 0; i < 4; ++i) {
            double correction = -rate_of(t_ext, y_ext) / acceleration(t_ext, y_ext);
            // the value errs by the square of this
            if (!(std::fabs(correction) > 1e-6 * (t1 - t)) || t_ext + correction <= t || t_ext + correction >= t1) return;
            t_ext += correction;
            step.state(t_ext, y_ext);
        }
    }

    template <class Step> bool stop(Step &step, double a, double d_a, double b, double d_b)
    {
        int way = leaves(d_b);
        double level = side + way < 0 || side < 0 ? -backlash : 0.0, at_b = d_b - level;
        // on a boundary to rounding at its start, a step counts as inside there
        double least = std::numeric_limits<double>::min();
        double at_a = way > 0 ? std::fmin(d_a - level, -least) : std::fmax(d_a - level, least);
        double t_stop = root([&](double x) { return step.d(x) - level; }, a, at_a, b, at_b), y_stop[size];
        step.state(t_stop, y_stop);
        for (int i = 0; i < 6; ++i) {
            double correction = -(d_of(t_stop, y_stop) - level) / rate_of(t_stop, y_stop);
            if (!(std::fabs(correction) > 4 * std::numeric_limits<double>::epsilon() * b)) break;
            if (t_stop + correction <= t || t_stop + correction > b) break;
            t_stop += correction;
            step.state(t_stop, y_stop);
        }
        sample(step, t_stop);
        side += way;
        t = piece_start = t_stop;
        for (int i = 0; i < size; ++i) y[i] = y_stop[i];
        d_here = level;
        rate_here = rate_of(t, y);
        ++result.event_count;
        if (grid_points > 0) result.events.push_back(t);
        return true;
    }

    template <class Step> void sample(Step &step, double to)
    {
        double state[size];
        for (; grid_next < grid_points; ++grid_next) {
            double time = grid_end * grid_next / (grid_points - 1);
            if (time > to) return;
            step.state(time, state);
            result.sample_times.push_back(time);
            result.samples.push_back(d_of(time, state));
        }
    }
};

// A step without dense output: `redo(t, y)` takes it anew from its start, to t.
template <class Motion, class Redo> class refined_t {
public:
    refined_t(const Motion &motion, double t_end, const double *y_end, Redo redo_to)
        : m(motion), redo(redo_to), t1(t_end), y1(y_end)
    {
    }
    double d(double t) { return polynomial().d(t); }
    double rate(double t) { return polynomial().rate(t); }
    void state(double t, double *y) { redo(t, y); }

private:
    const Motion &m;
    Redo redo;
    double t1;
    const double *y1;
    std::optional<hermite_t> guess;

    const hermite_t &polynomial()
    {
        if (!guess)
            guess.emplace(m.t, m.d_of(m.t, m.y), m.rate_of(m.t, m.y), m.acceleration(m.t, m.y), t1, m.d_of(t1, y1),
                          m.rate_of(t1, y1), m.acceleration(t1, y1));
        return *guess;
    }
};

// One peer: `follow(motion, method, rtol, t_end)` integrates a motion on to t_end. Setting `METHOD:FORM:RTOL`.
template <class Follow> void solve(const std::string &setting, bool p3, double rpm, result_t &result, Follow &&follow)
{
    size_t one = setting.find(':'), two = setting.find(':', one + 1);
    if (two == std::string::npos) {
        std::fprintf(stderr, "bad setting %s: METHOD:FORM:RTOL\n", setting.c_str());
        std::exit(2);
    }
    std::string method = setting.substr(0, one), form = setting.substr(one + 1, two - one - 1);
    double rtol = std::atof(setting.c_str() + two + 1);
    auto one_motion = [&](auto motion) {
        if (p3) {
            follow(motion, method, rtol, p3_from);
            motion.recording = true;
            follow(motion, method, rtol, p3_end);
        } else {
            motion.sample_to(p2_end, p2_points);
            follow(motion, method, rtol, p2_end);
        }
    };
    if (form == "full") one_motion(motion_t<false>(rpm, result));
    else if (form == "relative") one_motion(motion_t<true>(rpm, result));
    else {
        std::fprintf(stderr, "unknown form %s\n", form.c_str());
        std::exit(2);
    }
}

// Command line and output.
template <class Follow> int peer_main(int argc, char **argv, Follow &&follow)
{
    if (argc != 7) {
        std::fprintf(stderr, "usage: %s p2|p3 METHOD:FORM:RTOL FIRST LAST STEP OUTPUT\n", argv[0]);
        return 2;
    }
    double first = std::atof(argv[3]), last = std::atof(argv[4]), step = std::atof(argv[5]);
    std::FILE *out = std::fopen(argv[6], "w");
    if (!out) {
        std::perror(argv[6]);
        return 1;
    }
    result_t result;
    std::clock_t start = std::clock();
    int speeds = static_cast<int>(std::floor((last - first) / step + 0.5)) + 1;
    for (int i = 0; i < speeds; ++i) solve(argv[2], std::string(argv[1]) == "p3", first + i * step, result, follow);
    double cpu = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    for (const extremum_t &x : result.extrema) std::fprintf(out, "x %.17g %.17g %.17g %d\n", x.rpm, x.t, x.d, x.kind);
    for (double t : result.events) std::fprintf(out, "e %.17g\n", t);
    for (size_t i = 0; i < result.samples.size(); ++i)
        std::fprintf(out, "d %.17g %.17g\n", result.sample_times[i], result.samples[i]);
    std::fprintf(out, "# cpu %.6f\n# events %ld\n", cpu, result.event_count);
    if (std::fclose(out) != 0) {
        std::perror(argv[6]);
        return 1;
    }
    return 0;
}
