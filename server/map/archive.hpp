#pragma once

#include <absl/strings/string_view.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace saccade {

static_assert(std::endian::native == std::endian::little, "archives are little-endian");

/// Writes numbers one after another. One function lists the fields of a type for it and for
/// ArchiveReader alike, so that they cannot differ.
class ArchiveWriter {
 public:
  static constexpr bool kReads = false;
  template <typename T>
  void Number(T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  void Block(void* data, std::size_t size) { bytes_.append(static_cast<const char*>(data), size); }
  /// How many follow, each of at least `least_bytes`.
  template <typename List>
  void Count(List& list, std::size_t /*least_bytes*/) {
    std::uint64_t count = list.size();
    Number(count);
  }
  void Check(bool /*holds*/) {}
  bool ok() const { return true; }
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads what ArchiveWriter wrote; after the first thing that cannot be, all is zero and ok()
/// false.
class ArchiveReader {
 public:
  static constexpr bool kReads = true;
  explicit ArchiveReader(absl::string_view bytes) : left_(bytes) {}
  template <typename T>
  void Number(T& value) {
    value = T();
    Block(&value, sizeof(T));
    if constexpr (std::is_floating_point_v<T>) Check(std::isfinite(value));
  }
  void Block(void* data, std::size_t size) {
    Check(left_.size() >= size);
    if (!ok_) return;
    std::memcpy(data, left_.data(), size);
    left_.remove_prefix(size);
  }
  template <typename List>
  void Count(List& list, std::size_t least_bytes) {
    std::uint64_t count = 0;
    Number(count);
    Check(count <= left_.size() / least_bytes);
    list.resize(ok_ ? static_cast<std::size_t>(count) : 0);
  }
  void Check(bool holds) { ok_ = ok_ && holds; }
  bool ok() const { return ok_; }
  bool at_end() const { return left_.empty(); }

 private:
  absl::string_view left_;
  bool ok_ = true;
};

}  // namespace saccade
