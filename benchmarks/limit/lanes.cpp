// The work of rendulic's lane kernels (src/rendulic/dem/kernels/lanes.py) written by hand: what one core of
// this machine can do with the same arrays. Compiled and called by benchmarks/probing.py.
//
// Every number of a grain or contact is a vector of W doubles, one per lane, kept in registers: four lanes in
// AVX2, and eight in AVX-512 where the processor has it. Beside that:
//
// - the forces on a contact's first grain are summed in registers as long as the next contact has the same one,
// - the second grains of later contacts are fetched ahead,
// - the law, linear with Coulomb friction and the harmonic stiffness rule, is written out; the root and division
//   of sliding are left out where no lane slides,
// - the walls' exponential is taken once per call: strain rates do not change.
//
// Sums are taken in another order than rendulic's, hence results differ by rounding.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <immintrin.h>

namespace {

constexpr int POSITION = 0, VELOCITY = 3, SPIN = 6, FORCE = 9, TORQUE = 12, ORIGIN = 15, ROWS = 18;
constexpr int64_t AHEAD = 6; // contacts between fetching a second grain and using it

} // namespace

// The arrays of `rendulic.dem.lanes.Lanes`; the order of the fields is that in probing.py.
struct Arrays {
  double *state;  // [grain][ROWS][W]
  const double *radius, *mass, *inertia;
  const int32_t *first, *second;
  double *held;  // [contact][4][W]
  const int32_t *grain, *wall;
  double *wall_held;  // [wall contact][W]
  double *wall_position, *wall_origin, *wall_force, *wall_stiffness;  // [6][W]
  const double *rates;  // [3][W]
  int64_t n_grains, n_contacts, n_wall_contacts;
  double dt, damping, modulus, ratio, friction, reach;
};

namespace {

template <int W> struct Vector;
template <> struct Vector<4> {
  typedef double D __attribute__((vector_size(32)));
  typedef int64_t I __attribute__((vector_size(32)));
  static D root(D x) { return (D)_mm256_sqrt_pd((__m256d)x); }
  static bool any(I x) { return !_mm256_testz_si256((__m256i)x, (__m256i)x); }
};
#ifdef __AVX512F__
template <> struct Vector<8> {
  typedef double D __attribute__((vector_size(64)));
  typedef int64_t I __attribute__((vector_size(64)));
  static D root(D x) { return (D)_mm512_sqrt_pd((__m512d)x); }
  static bool any(I x) { return _mm512_test_epi64_mask((__m512i)x, (__m512i)x) != 0; }
};
#endif

template <int W> struct Kernel {
  typedef typename Vector<W>::D D;
  typedef typename Vector<W>::I I;

  // a row in memory: arrays need not be aligned to whole vectors
  struct Row {
    double *at;
    D get() const {
      D x;
      std::memcpy(&x, at, sizeof x);
      return x;
    }
    void operator=(D x) const { std::memcpy(at, &x, sizeof x); }
    void operator+=(D x) const { *this = get() + x; }
    void operator-=(D x) const { *this = get() - x; }
  };
  static Row row(double *at, int64_t k) { return {at + k * W}; }
  static D get(double *at, int64_t k) { return row(at, k).get(); }
  static D all(double x) { return D{} + x; }

  // the sign bit of `of` on `size`
  static D signed_as(D size, D of) {
    const I sign = I{} + INT64_MIN;
    return (D)(((I)of & sign) | (I)size);
  }

  static bool move(const Arrays &a) {
    const double reach2 = a.reach * a.reach, dt = a.dt;
    const D damping = all(a.damping);
    I beyond = I{};
    for (int64_t g = 0; g < a.n_grains; ++g) {
      double *own = a.state + g * ROWS * W;
      const double impulse = dt / a.mass[g], angular = dt / a.inertia[g];
      D moved2 = D{};
      for (int k = 0; k < 3; ++k) {
        D old = get(own, VELOCITY + k), full = get(own, FORCE + k);
        const D v = old + impulse * (full * (1.0 - signed_as(damping, full * (old + 0.5 * impulse * full))));
        const D x = get(own, POSITION + k) + dt * v;
        const D away = x - get(own, ORIGIN + k);
        moved2 += away * away;
        row(own, VELOCITY + k) = v;
        row(own, POSITION + k) = x;
        row(own, FORCE + k) = D{};
        old = get(own, SPIN + k), full = get(own, TORQUE + k);
        row(own, SPIN + k) =
            old + angular * (full * (1.0 - signed_as(damping, full * (old + 0.5 * angular * full))));
        row(own, TORQUE + k) = D{};
      }
      beyond |= ~(moved2 <= reach2);
    }
    return Vector<W>::any(beyond);
  }

  static void fetch(const double *grain) {
    for (int line = 0; line < 15 * W / 8; ++line) _mm_prefetch((const char *)(grain + 8 * line), _MM_HINT_T0);
  }

  static void contacts(const Arrays &a) {
    const double dt = a.dt;
    int64_t c = 0;
    while (c < a.n_contacts) {
      const int32_t i = a.first[c];
      double *one = a.state + int64_t(i) * ROWS * W;
      const double r1 = a.radius[i];
      const D x1 = get(one, 0), y1 = get(one, 1), z1 = get(one, 2);
      const D vx1 = get(one, 3), vy1 = get(one, 4), vz1 = get(one, 5);
      const D sx = get(one, 6), sy = get(one, 7), sz = get(one, 8);
      D Fx = D{}, Fy = D{}, Fz = D{}, Mx = D{}, My = D{}, Mz = D{};
      for (; c < a.n_contacts && a.first[c] == i; ++c) {
        if (c + AHEAD < a.n_contacts) fetch(a.state + int64_t(a.second[c + AHEAD]) * ROWS * W);
        const int32_t j = a.second[c];
        double *two = a.state + int64_t(j) * ROWS * W;
        double *held = a.held + c * 4 * W;
        const double r2 = a.radius[j], reach = r1 + r2, reach2 = reach * reach;
        D nx = get(two, 0) - x1, ny = get(two, 1) - y1, nz = get(two, 2) - z1;
        const D distance2 = nx * nx + ny * ny + nz * nz;
        const I closed = distance2 < reach2;
        if (!Vector<W>::any(closed | (get(held, 0) != 0.0))) continue;
        const double k_n = 4.0 * a.modulus * r1 * r2 / reach, k_t = a.ratio * k_n;
        const D distance = Vector<W>::root(distance2), scale = 1.0 / distance, overlap = reach - distance;
        nx *= scale, ny *= scale, nz *= scale;
        const D a1 = r1 - 0.5 * overlap, a2 = r2 - 0.5 * overlap;
        const D ux = get(two, 6), uy = get(two, 7), uz = get(two, 8);
        const D wx = a1 * sx + a2 * ux, wy = a1 * sy + a2 * uy, wz = a1 * sz + a2 * uz;
        const D vx = get(two, 3) - vx1 - (wy * nz - wz * ny);
        const D vy = get(two, 4) - vy1 - (wz * nx - wx * nz);
        const D vz = get(two, 5) - vz1 - (wx * ny - wy * nx);
        const D vn = vx * nx + vy * ny + vz * nz;
        D fx = get(held, 1), fy = get(held, 2), fz = get(held, 3);
        const D along = fx * nx + fy * ny + fz * nz;
        fx -= along * nx, fy -= along * ny, fz -= along * nz;
        const D turn = 0.5 * dt * ((sx + ux) * nx + (sy + uy) * ny + (sz + uz) * nz);
        const double slip = k_t * dt;
        D tx = fx + turn * (ny * fz - nz * fy) - slip * (vx - vn * nx);
        D ty = fy + turn * (nz * fx - nx * fz) - slip * (vy - vn * ny);
        D tz = fz + turn * (nx * fy - ny * fx) - slip * (vz - vn * nz);
        const D pressing = k_n * overlap, limit = a.friction * pressing;
        const D trial2 = tx * tx + ty * ty + tz * tz;
        const I slides = trial2 > limit * limit;
        if (Vector<W>::any(slides & closed)) {
          const D shorter = slides ? limit / Vector<W>::root(trial2) : all(1.0);
          tx *= shorter, ty *= shorter, tz *= shorter;
        }
        const D fn = closed ? pressing : D{};
        tx = closed ? tx : D{}, ty = closed ? ty : D{}, tz = closed ? tz : D{};
        row(held, 0) = fn, row(held, 1) = tx, row(held, 2) = ty, row(held, 3) = tz;
        const D px = fn * nx + tx, py = fn * ny + ty, pz = fn * nz + tz;
        const D mx = ny * tz - nz * ty, my = nz * tx - nx * tz, mz = nx * ty - ny * tx;
        Fx += px, Fy += py, Fz += pz;
        Mx += a1 * mx, My += a1 * my, Mz += a1 * mz;
        row(two, FORCE) += px, row(two, FORCE + 1) += py, row(two, FORCE + 2) += pz;
        row(two, TORQUE) -= a2 * mx, row(two, TORQUE + 1) -= a2 * my, row(two, TORQUE + 2) -= a2 * mz;
      }
      row(one, FORCE) -= Fx, row(one, FORCE + 1) -= Fy, row(one, FORCE + 2) -= Fz;
      row(one, TORQUE) -= Mx, row(one, TORQUE + 1) -= My, row(one, TORQUE + 2) -= Mz;
    }
  }

  static void walls(const Arrays &a) {
    for (int w = 0; w < 6; ++w) row(a.wall_force, w) = D{}, row(a.wall_stiffness, w) = D{};
    for (int64_t c = 0; c < a.n_wall_contacts; ++c) {
      const int32_t g = a.grain[c], w = a.wall[c];
      const double side = w % 2 == 0 ? 1.0 : -1.0, k_n = 2.0 * a.modulus * a.radius[g];
      double *own = a.state + int64_t(g) * ROWS * W;
      const D overlap = a.radius[g] - side * (get(own, POSITION + w / 2) - get(a.wall_position, w));
      const I closed = overlap > 0.0;
      const D pressing = closed ? k_n * overlap : D{};
      row(a.wall_held, c) = pressing;
      row(own, FORCE + w / 2) += side * pressing;
      row(a.wall_force, w) += pressing;
      row(a.wall_stiffness, w) += closed ? all(k_n) : D{};
    }
  }

  // Makes up to n steps; -1 - (steps made) when the list of candidates must be made anew, as in advance_lanes.
  static int64_t advance(const Arrays &a, int64_t n) {
    D inward[3];
    for (int axis = 0; axis < 3; ++axis)
      for (int lane = 0; lane < W; ++lane) inward[axis][lane] = -0.5 * std::expm1(-a.rates[axis * W + lane] * a.dt);
    for (int64_t made = 0; made < n; ++made) {
      bool beyond = move(a);
      for (int axis = 0; axis < 3; ++axis) {
        D low = get(a.wall_position, 2 * axis), high = get(a.wall_position, 2 * axis + 1);
        const D by = (high - low) * inward[axis];
        low += by, high -= by;
        row(a.wall_position, 2 * axis) = low;
        row(a.wall_position, 2 * axis + 1) = high;
        const D l = low - get(a.wall_origin, 2 * axis), h = high - get(a.wall_origin, 2 * axis + 1);
        beyond |= Vector<W>::any(~((l <= a.reach) & (l >= -a.reach) & (h <= a.reach) & (h >= -a.reach)));
      }
      if (beyond) return -1 - made;
      contacts(a);
      walls(a);
    }
    return n;
  }
};

} // namespace

#define EXPORT(W)                                                                                              \
  extern "C" int64_t advance_##W(const Arrays *a, int64_t n) { return Kernel<W>::advance(*a, n); }             \
  extern "C" void move_##W(const Arrays *a) { Kernel<W>::move(*a); }                                           \
  extern "C" void contacts_##W(const Arrays *a) { Kernel<W>::contacts(*a); }                                   \
  extern "C" void walls_##W(const Arrays *a) { Kernel<W>::walls(*a); }

EXPORT(4)
#ifdef __AVX512F__
EXPORT(8)
#endif
