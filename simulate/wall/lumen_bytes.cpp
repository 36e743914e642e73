/// The lumen's field as bytes and back: a head, then every member in turn, each list after its
/// length.
#include <cstring>
#include <type_traits>

#include "simulate/wall/lumen.h"

namespace wireplan::simulate {
namespace {

// Raised when the field or its layout changes; the double tells the byte order.
constexpr std::string_view kHead = "wireplan.lumen/1";
constexpr double kOrderMark = 1.0 / 3.0;

template <typename Value>
void put(std::string& bytes, const Value& value) {
  static_assert(std::is_arithmetic_v<Value>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put(std::string& bytes, const Vec3& p) {
  for (const double x : p) put(bytes, x);
}

template <typename Value>
void put(std::string& bytes, const std::vector<Value>& list) {
  put(bytes, static_cast<std::uint64_t>(list.size()));
  bytes.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof(Value));
}

/// Reads what put() wrote; after the first thing that is not there it gives zeros.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  bool starts_with(std::string_view head) {
    sound_ = sound_ && rest_.starts_with(head);
    if (sound_) rest_.remove_prefix(head.size());
    return sound_;
  }
  template <typename Value>
  Value number() {
    Value value{};
    take(&value, sizeof value);
    return value;
  }
  Vec3 point() {
    Vec3 p;
    for (double& x : p) x = number<double>();
    return p;
  }
  template <typename Value>
  std::vector<Value> list() {
    const auto size = number<std::uint64_t>();
    if (size > rest_.size() / sizeof(Value)) sound_ = false;
    std::vector<Value> values(sound_ ? size : 0);
    take(values.data(), values.size() * sizeof(Value));
    return values;
  }
  bool ends_here() const { return sound_ && rest_.empty(); }
  bool sound() const { return sound_; }

 private:
  void take(void* to, std::size_t count) {
    sound_ = sound_ && count <= rest_.size();
    if (!sound_ || count == 0) return;
    std::memcpy(to, rest_.data(), count);
    rest_.remove_prefix(count);
  }
  std::string_view rest_;
  bool sound_ = true;
};

}  // namespace

std::string Lumen::to_bytes() const {
  std::string bytes(kHead);
  bytes.reserve(memory_bytes() + 4096);
  put(bytes, kOrderMark);
  for (const double value : {spacing_, band_, max_deviation_, mean_deviation_}) put(bytes, value);
  put(bytes, origin_);
  for (const int count : bricks_) put(bytes, count);
  put(bytes, static_cast<std::uint64_t>(openings_.size()));
  for (const preprocess::Opening& opening : openings_) {
    put(bytes, opening.center);
    put(bytes, opening.normal);
    put(bytes, opening.radius);
    put(bytes, opening.triangles);
  }
  put(bytes, brick_);
  put(bytes, coefficients_);
  return bytes;
}

std::optional<Lumen> Lumen::from_bytes(std::string_view bytes) {
  Reader reader(bytes);
  if (!reader.starts_with(kHead) || reader.number<double>() != kOrderMark) return {};
  Lumen lumen;
  for (double* value :
       {&lumen.spacing_, &lumen.band_, &lumen.max_deviation_, &lumen.mean_deviation_}) {
    *value = reader.number<double>();
  }
  lumen.origin_ = reader.point();
  for (int& count : lumen.bricks_) count = reader.number<int>();
  const auto openings = reader.number<std::uint64_t>();
  for (std::uint64_t k = 0; k < openings && reader.sound(); ++k) {
    preprocess::Opening& opening = lumen.openings_.emplace_back();
    opening.center = reader.point();
    opening.normal = reader.point();
    opening.radius = reader.number<double>();
    opening.triangles = reader.list<int>();
  }
  lumen.brick_ = reader.list<std::int32_t>();
  lumen.coefficients_ = reader.list<float>();
  if (!reader.ends_here()) return {};
  return lumen;
}

}  // namespace wireplan::simulate
