// SPDX-License-Identifier: Apache-2.0
// Two doubles in one SSE2 register, for running one computation on two inputs at once. Each half rounds as
// a plain double does, so results have the same bits.
#pragma once

#include <cmath>

#if defined(__SSE2__)
#define SHAPEDB_DOUBLE2_SSE2 1
#include <emmintrin.h>
#else
#define SHAPEDB_DOUBLE2_SSE2 0
#endif

namespace shapedb {

#if SHAPEDB_DOUBLE2_SSE2

class Double2 {
  public:
    Double2() = default;
    Double2(double both) : v_(_mm_set1_pd(both)) {}  // NOLINT: implicit, a number stands for both halves
    Double2(double low, double high) : v_(_mm_set_pd(high, low)) {}

    double low() const { return _mm_cvtsd_f64(v_); }
    double high() const { return _mm_cvtsd_f64(_mm_unpackhi_pd(v_, v_)); }

    friend Double2 operator+(Double2 a, Double2 b) { return Double2(_mm_add_pd(a.v_, b.v_)); }
    friend Double2 operator-(Double2 a, Double2 b) { return Double2(_mm_sub_pd(a.v_, b.v_)); }
    friend Double2 operator*(Double2 a, Double2 b) { return Double2(_mm_mul_pd(a.v_, b.v_)); }
    friend Double2 operator/(Double2 a, Double2 b) { return Double2(_mm_div_pd(a.v_, b.v_)); }
    /// a < b ? a : b
    friend Double2 lesser(Double2 a, Double2 b) { return Double2(_mm_min_pd(a.v_, b.v_)); }
    /// a > b ? a : b
    friend Double2 greater(Double2 a, Double2 b) { return Double2(_mm_max_pd(a.v_, b.v_)); }
    friend Double2 sqrt(Double2 a) { return Double2(_mm_sqrt_pd(a.v_)); }
    friend Double2 abs(Double2 a) { return Double2(_mm_andnot_pd(_mm_set1_pd(-0.0), a.v_)); }
    /// Bit 0: low a < low b. Bit 1: high a < high b.
    friend unsigned less(Double2 a, Double2 b) {
        return static_cast<unsigned>(_mm_movemask_pd(_mm_cmplt_pd(a.v_, b.v_)));
    }

  private:
    explicit Double2(__m128d v) : v_(v) {}
    __m128d v_;
};

#else

class Double2 {
  public:
    Double2() = default;
    Double2(double both) : low_(both), high_(both) {}  // NOLINT: implicit, a number stands for both halves
    Double2(double low, double high) : low_(low), high_(high) {}

    double low() const { return low_; }
    double high() const { return high_; }

    friend Double2 operator+(Double2 a, Double2 b) { return {a.low_ + b.low_, a.high_ + b.high_}; }
    friend Double2 operator-(Double2 a, Double2 b) { return {a.low_ - b.low_, a.high_ - b.high_}; }
    friend Double2 operator*(Double2 a, Double2 b) { return {a.low_ * b.low_, a.high_ * b.high_}; }
    friend Double2 operator/(Double2 a, Double2 b) { return {a.low_ / b.low_, a.high_ / b.high_}; }
    friend Double2 lesser(Double2 a, Double2 b) {
        return {a.low_ < b.low_ ? a.low_ : b.low_, a.high_ < b.high_ ? a.high_ : b.high_};
    }
    friend Double2 greater(Double2 a, Double2 b) {
        return {a.low_ > b.low_ ? a.low_ : b.low_, a.high_ > b.high_ ? a.high_ : b.high_};
    }
    friend Double2 sqrt(Double2 a) { return {std::sqrt(a.low_), std::sqrt(a.high_)}; }
    friend Double2 abs(Double2 a) { return {std::abs(a.low_), std::abs(a.high_)}; }
    friend unsigned less(Double2 a, Double2 b) {
        return (a.low_ < b.low_ ? 1u : 0u) | (a.high_ < b.high_ ? 2u : 0u);
    }

  private:
    double low_;
    double high_;
};

#endif

}  // namespace shapedb
