// Two doubles that one instruction handles: two equal computations side by side. Every operation rounds
// as it does on one double, so results have the same bits.
#pragma once

#include <cmath>

#if defined(__SSE2__)
#define SHAPEDB_PAIR_SSE2 1
#include <emmintrin.h>
#else
#define SHAPEDB_PAIR_SSE2 0
#endif

namespace shapedb {

#if SHAPEDB_PAIR_SSE2

class Pair {
  public:
    Pair() = default;
    Pair(double both) : v_(_mm_set1_pd(both)) {}  // NOLINT: a number stands for two of it
    Pair(double low, double high) : v_(_mm_set_pd(high, low)) {}

    double low() const { return _mm_cvtsd_f64(v_); }
    double high() const { return _mm_cvtsd_f64(_mm_unpackhi_pd(v_, v_)); }

    friend Pair operator+(Pair a, Pair b) { return Pair(_mm_add_pd(a.v_, b.v_)); }
    friend Pair operator-(Pair a, Pair b) { return Pair(_mm_sub_pd(a.v_, b.v_)); }
    friend Pair operator*(Pair a, Pair b) { return Pair(_mm_mul_pd(a.v_, b.v_)); }
    friend Pair operator/(Pair a, Pair b) { return Pair(_mm_div_pd(a.v_, b.v_)); }
    /// a < b ? a : b
    friend Pair lesser(Pair a, Pair b) { return Pair(_mm_min_pd(a.v_, b.v_)); }
    /// a > b ? a : b
    friend Pair greater(Pair a, Pair b) { return Pair(_mm_max_pd(a.v_, b.v_)); }
    friend Pair sqrt(Pair a) { return Pair(_mm_sqrt_pd(a.v_)); }
    friend Pair abs(Pair a) { return Pair(_mm_andnot_pd(_mm_set1_pd(-0.0), a.v_)); }
    /// Bit 0: low a < low b. Bit 1: high a < high b.
    friend unsigned less(Pair a, Pair b) {
        return static_cast<unsigned>(_mm_movemask_pd(_mm_cmplt_pd(a.v_, b.v_)));
    }

  private:
    explicit Pair(__m128d v) : v_(v) {}
    __m128d v_;
};

#else

class Pair {
  public:
    Pair() = default;
    Pair(double both) : low_(both), high_(both) {}  // NOLINT: a number stands for two of it
    Pair(double low, double high) : low_(low), high_(high) {}

    double low() const { return low_; }
    double high() const { return high_; }

    friend Pair operator+(Pair a, Pair b) { return {a.low_ + b.low_, a.high_ + b.high_}; }
    friend Pair operator-(Pair a, Pair b) { return {a.low_ - b.low_, a.high_ - b.high_}; }
    friend Pair operator*(Pair a, Pair b) { return {a.low_ * b.low_, a.high_ * b.high_}; }
    friend Pair operator/(Pair a, Pair b) { return {a.low_ / b.low_, a.high_ / b.high_}; }
    friend Pair lesser(Pair a, Pair b) {
        return {a.low_ < b.low_ ? a.low_ : b.low_, a.high_ < b.high_ ? a.high_ : b.high_};
    }
    friend Pair greater(Pair a, Pair b) {
        return {a.low_ > b.low_ ? a.low_ : b.low_, a.high_ > b.high_ ? a.high_ : b.high_};
    }
    friend Pair sqrt(Pair a) { return {std::sqrt(a.low_), std::sqrt(a.high_)}; }
    friend Pair abs(Pair a) { return {std::abs(a.low_), std::abs(a.high_)}; }
    friend unsigned less(Pair a, Pair b) {
        return (a.low_ < b.low_ ? 1u : 0u) | (a.high_ < b.high_ ? 2u : 0u);
    }

  private:
    double low_;
    double high_;
};

#endif

}  // namespace shapedb
