// The fuzzer's bytes, consumed one after the other; zeros when they are used up.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>

namespace palpate::tests {

class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  bool empty() const { return left_ == 0; }

  template <class Number>
  Number raw() {
    Number number{};
    const std::size_t count = left_ < sizeof number ? left_ : sizeof number;
    std::memcpy(&number, data_, count);
    data_ += count, left_ -= count;
    return number;
  }
  std::uint32_t below(std::uint32_t end) { return (end <= 256 ? raw<std::uint8_t>() : raw<std::uint32_t>()) % end; }
  bool flag() { return below(2) == 1; }

  // Usually a number of about `size`, as a caller would pass; otherwise an extreme value or any bits.
  double number(double size) {
    using Limits = std::numeric_limits<double>;
    const double edges[] = {0,
                            -0.0,
                            1,
                            -1,
                            NAN,
                            -NAN,
                            INFINITY,
                            -INFINITY,
                            1e6,
                            -1e6,
                            1e300,
                            -1e300,
                            Limits::max(),
                            -Limits::max(),
                            Limits::min(),
                            Limits::denorm_min(),
                            -Limits::denorm_min(),
                            1e-30,
                            0.5,
                            1 - 1e-9};
    const std::uint32_t kind = below(256);
    if (kind < 24) return edges[kind % std::size(edges)];
    if (kind < 32) return raw<double>();
    return size * (raw<std::uint16_t>() / 32768.0 - 1);
  }
  std::int32_t integer(std::int32_t end) {
    const std::int32_t edges[] = {0, 1, -1, INT32_MAX, INT32_MIN, end, end - 1, end + 1};
    const std::uint32_t kind = below(256);
    if (kind < 16) return edges[kind % std::size(edges)];
    return end > 0 ? static_cast<std::int32_t>(below(static_cast<std::uint32_t>(end))) : raw<std::int32_t>();
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

}  // namespace palpate::tests
