#pragma once
/// Four numbers at once, for loops that the compiler does not do so by itself. The same bits
/// whatever registers the processor has: sums keep the order that is written here.
#include <cstddef>

// What is WIDE is compiled for registers of four numbers too, and taken where the processor has
// them; what it calls is compiled into it.
#if defined(__GNUC__) && defined(__x86_64__)
#define WIREPLAN_WIDE __attribute__((target("avx2")))
#define WIREPLAN_INLINE __attribute__((always_inline)) inline
#else
#define WIREPLAN_WIDE
#define WIREPLAN_INLINE inline
#endif

namespace wireplan::simulate {

/// In one register where the processor has such, else in two.
using Lane = double __attribute__((vector_size(32)));
using StoredLane = double __attribute__((vector_size(32), aligned(8), may_alias));
inline constexpr std::size_t kLane = 4;

inline bool has_wide_registers() {
#if defined(__GNUC__) && defined(__x86_64__)
  static const bool has = __builtin_cpu_supports("avx2");
  return has;
#else
  return false;
#endif
}

namespace lanes {

/// From and to numbers that need not be aligned.
WIREPLAN_INLINE void load(const double* from, Lane& to) { __builtin_memcpy(&to, from, sizeof(to)); }
WIREPLAN_INLINE void store(const Lane& from, double* to) {
  __builtin_memcpy(to, &from, sizeof(from));
}

/// a . b, of n numbers each, in four sums of every fourth.
WIREPLAN_INLINE double dot(const double* a, const double* b, std::size_t n) {
  Lane sum[2] = {};  // so that none waits for the other
  std::size_t k = 0;
  for (; k + 2 * kLane <= n; k += 2 * kLane) {
    for (std::size_t q = 0; q < 2; ++q) {
      Lane one, other;
      load(a + k + kLane * q, one);
      load(b + k + kLane * q, other);
      sum[q] += one * other;
    }
  }
  double rest = 0.0;
  for (; k < n; ++k) rest += a[k] * b[k];
  const Lane both = sum[0] + sum[1];
  return (both[0] + both[2]) + (both[1] + both[3]) + rest;
}

/// y += s x, of n numbers each.
WIREPLAN_INLINE void add_scaled(double s, const double* x, double* y, std::size_t n) {
  std::size_t k = 0;
  for (; k + kLane <= n; k += kLane) {
    Lane from, to;
    load(x + k, from);
    load(y + k, to);
    to += s * from;
    store(to, y + k);
  }
  for (; k < n; ++k) y[k] += s * x[k];
}

}  // namespace lanes
}  // namespace wireplan::simulate
