// Case 2 of the paper with the hierarchical law in scalar C++: the arithmetic of the package's compiled loop, written by hand.
//
//     case2 INPUT RUNS
//
// INPUT is a binary file of doubles, written by benchmarks/batch.py: the constants in the order of `Constants`, the number of
// steps, then for each step the reference x, y, psi, u, v, r, du, dv, dr. Run i starts i·0.1 mm further east. Prints the
// nanoseconds of processor time of a step, and for the last run the final state, the rms and the largest position error.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

struct Vessel { double m11, m22, m33, d_u, d_v, d_r, d_u2, d_u3, d_v2, d_v3, d_r2, d_r3; };
struct Periodic { double F_u, F_v, N_r, frequency, phase; };
struct Actuator { double limit, largest_change, share, instant; };
struct Gains { double c1, c2, c3, a, b, k1, k2, eta1, eta2, gamma1, gamma2, gamma3, m11, m33, T; };
struct Motion { double x, y, psi, u, v, r; };
struct Constants { Vessel vessel; Periodic periodic; Actuator surge, yaw; Gains gains; double axis[3], delta, step; Motion start; };
struct Reference { Motion motion; double du, dv, dr; };
struct Transformed { double z1, z2, z3; };
struct Result { Motion motion; double rms, largest; };
static_assert(sizeof(Constants) == 51 * sizeof(double));

constexpr int K = 3, L = K * K * K;
const double PI = std::acos(-1.0);

struct Law {
    std::array<std::array<double, L>, 3> W{};
    std::array<double, L> H{};
    double rate_u = 0.0, rate_v = 0.0, rate_r = 0.0, side = 0.0;
};

static double clip(double value, double limit) { return value > limit ? limit : value < -limit ? -limit : value; }
static double sign(double value) { return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0; }

static double wrap(double angle) {
    if (-PI < angle && angle <= PI) return angle;
    return angle - 2.0 * PI * std::ceil((angle - PI) / (2.0 * PI));
}

// As a message carries it: the heading as a quaternion.
static Motion published(Motion m) {
    const double z = std::sin(0.5 * m.psi), w = std::cos(0.5 * m.psi);
    m.psi = std::atan2(2.0 * (w * z), w * w - z * z);
    return m;
}

static Motion rate_of_motion(const Motion& m, double tau_1, double tau_2, const double* disturbing, const Vessel& s) {
    const double u = m.u, v = m.v, r = m.r, c = std::cos(m.psi), q = std::sin(m.psi);
    const double f_u = (s.m22 * v * r - s.d_u * u - s.d_u2 * std::abs(u) * u - s.d_u3 * u * u * u) / s.m11;
    const double f_v = (-s.m11 * u * r - s.d_v * v - s.d_v2 * std::abs(v) * v - s.d_v3 * v * v * v) / s.m22;
    const double f_r = ((s.m11 - s.m22) * u * v - s.d_r * r - s.d_r2 * std::abs(r) * r - s.d_r3 * r * r * r) / s.m33;
    return {u * c - v * q, u * q + v * c, r, f_u + tau_1 / s.m11 + disturbing[0], f_v + disturbing[1], f_r + tau_2 / s.m33 + disturbing[2]};
}

static Motion moved(const Motion& m, double step, const Motion& k) {
    return {m.x + step * k.x, m.y + step * k.y, m.psi + step * k.psi, m.u + step * k.u, m.v + step * k.v, m.r + step * k.r};
}

static Motion rk4(const Motion& m, double tau_1, double tau_2, const double* disturbing, const Vessel& s, double step) {
    const Motion k1 = rate_of_motion(m, tau_1, tau_2, disturbing, s);
    const Motion k2 = rate_of_motion(moved(m, 0.5 * step, k1), tau_1, tau_2, disturbing, s);
    const Motion k3 = rate_of_motion(moved(m, 0.5 * step, k2), tau_1, tau_2, disturbing, s);
    const Motion k4 = rate_of_motion(moved(m, step, k3), tau_1, tau_2, disturbing, s);
    const Motion mean = {k1.x + 2.0 * (k2.x + k3.x) + k4.x, k1.y + 2.0 * (k2.y + k3.y) + k4.y, k1.psi + 2.0 * (k2.psi + k3.psi) + k4.psi,
                         k1.u + 2.0 * (k2.u + k3.u) + k4.u, k1.v + 2.0 * (k2.v + k3.v) + k4.v, k1.r + 2.0 * (k2.r + k3.r) + k4.r};
    return moved(m, step / 6.0, mean);
}

static double actuate(double last, double command, const Actuator& a) {
    double target = clip(command, a.limit);
    const double change = a.share * (target - last);
    if (std::abs(change) > a.largest_change) target = last + std::copysign(a.largest_change, change);
    else if (a.instant == 0.0) target = last + change;
    return clip(target, a.limit);
}

static Transformed transform(const Motion& m) {
    const double c = std::cos(m.psi), s = std::sin(m.psi);
    return {m.x * c + m.y * s, -m.x * s + m.y * c, m.psi};
}

static void activate(const Motion& m, const Constants& c, std::array<double, L>& H) {
    const double scale = -0.5 / (c.delta * c.delta);
    double along[K], across[K], turn[K];
    for (int i = 0; i < K; i++) {
        const double du = m.u - c.axis[i], dv = m.v - c.axis[i], dr = m.r - c.axis[i];
        along[i] = std::exp(du * du * scale), across[i] = std::exp(dv * dv * scale), turn[i] = std::exp(dr * dr * scale);
    }
    for (int i = 0; i < K; i++)
        for (int j = 0; j < K; j++)
            for (int k = 0; k < K; k++) H[(i * K + j) * K + k] = along[i] * (across[j] * turn[k]);
}

static double output(const std::array<double, L>& W, const std::array<double, L>& H) {
    double total = 0.0;
    for (int i = 0; i < L; i++) total += W[i] * H[i];
    return total;
}

// Equations (9) to (29); false at the singularity.
static bool control(const Motion& m, const Reference& ref, Law& law, const Constants& constants, double& tau_1, double& tau_2) {
    const Gains& g = constants.gains;
    const Motion& d = ref.motion;
    const double u = m.u, v = m.v, r = m.r;
    const Transformed z = transform(m), z_d = transform(d);
    const double distance = g.b - g.a * z.z1;
    if (std::abs(distance) <= 1e-9 * g.b || distance * law.side < 0.0) return false;
    law.side = std::copysign(1.0, distance);
    for (int i = 0; i < L; i++) law.W[0][i] += g.T * law.rate_u * law.H[i];
    for (int i = 0; i < L; i++) law.W[1][i] += g.T * law.rate_v * law.H[i];
    for (int i = 0; i < L; i++) law.W[2][i] += g.T * law.rate_r * law.H[i];
    activate(m, constants, law.H);
    const double fu = output(law.W[0], law.H), fv = output(law.W[1], law.H), fr = output(law.W[2], law.H);

    const double dz1e = (u + z.z2 * r) - (d.u + z_d.z2 * d.r), dz2e = (v - z.z1 * r) - (d.v - z_d.z1 * d.r), dz3e = r - d.r;
    const double ddz_d1 = ref.du + (d.v - z_d.z1 * d.r) * d.r + z_d.z2 * ref.dr;
    const double ddz_d2 = ref.dv - (d.u + z_d.z2 * d.r) * d.r - z_d.z1 * ref.dr;
    const double z1e = z.z1 - z_d.z1, z2e = z.z2 - z_d.z2, z3e = wrap(z.z3 - z_d.z3);
    const double sigma1 = g.c1 * z2e + dz2e, sigma2 = g.c2 * z3e + dz3e;
    const double S1 = g.a * sigma1 + g.b * sigma2, S2 = g.c3 * z1e + dz1e;

    const double z1_tau_eq21 = -g.m33 * (-g.c1 * dz2e - fv + (u + z.z2 * r) * r + z.z1 * fr + ddz_d2);
    const double tau_eq22 = g.m33 * (-g.c2 * dz3e - fr + ref.dr);
    const double reaching = g.m33 * (-g.eta1 * sign(S1) - g.k1 * S1);
    tau_2 = (g.b * tau_eq22 - g.a * z1_tau_eq21 + reaching) / (g.b - g.a * z.z1);
    const double tau_eq1 = g.m11 * (-g.c3 * dz1e - fu - (v - z.z1 * r) * r - z.z2 * (fr + tau_2 / g.m33) + ddz_d1);
    tau_1 = tau_eq1 + g.m11 * (-g.eta2 * sign(S2) - g.k2 * S2);

    law.rate_u = g.gamma3 * S2, law.rate_v = g.gamma1 * g.a * S1, law.rate_r = g.gamma2 * ((g.b - g.a * z.z1) * S1 + z.z2 * S2);
    return true;
}

static Result run(const Constants& c, const std::vector<Reference>& reference, double offset) {
    Law law;
    Motion motion = c.start;
    motion.x += offset;
    double tau_1 = 0.0, tau_2 = 0.0, applied_1 = 0.0, applied_2 = 0.0, squares = 0.0, largest = 0.0;
    const size_t n = reference.size();
    for (size_t k = 0; k < n; k++) {
        const double factor = 1.0 + std::sin(c.periodic.frequency * (double(k) * c.step) + c.periodic.phase);
        const double disturbing[3] = {c.periodic.F_u * factor / c.vessel.m11, c.periodic.F_v * factor / c.vessel.m22,
                                      c.periodic.N_r * factor / c.vessel.m33};
        const Motion measured = published(motion);
        if (!control(measured, reference[k], law, c, tau_1, tau_2)) std::abort();
        const double ex = measured.x - reference[k].motion.x, ey = measured.y - reference[k].motion.y;
        squares += ex * ex + ey * ey;
        largest = std::max(largest, ex * ex + ey * ey);
        applied_1 = actuate(applied_1, tau_1, c.surge), applied_2 = actuate(applied_2, tau_2, c.yaw);
        if (k + 1 < n) motion = rk4(motion, applied_1, applied_2, disturbing, c.vessel, c.step);
        if (!std::isfinite(motion.x + motion.y + motion.psi + motion.u + motion.v + motion.r)) std::abort();
    }
    return {motion, std::sqrt(squares / double(n)), std::sqrt(largest)};
}

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    std::FILE* file = std::fopen(argv[1], "rb");
    Constants constants;
    double count = 0.0;
    if (!file || std::fread(&constants, sizeof constants, 1, file) != 1 || std::fread(&count, sizeof count, 1, file) != 1) return 2;
    std::vector<Reference> reference(static_cast<size_t>(count));
    if (std::fread(reference.data(), sizeof(Reference), reference.size(), file) != reference.size()) return 2;
    const int runs = std::atoi(argv[2]);
    Result last{};
    const std::clock_t began = std::clock();  // processor time: other load on the machine does not count
    for (int i = 0; i < runs; i++) last = run(constants, reference, 1e-4 * i);
    const double took = 1e9 * double(std::clock() - began) / CLOCKS_PER_SEC;
    const Motion& m = last.motion;
    std::printf("%.3f %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", took / runs / count, m.x, m.y, m.psi, m.u, m.v, m.r, last.rms,
                last.largest);
}
