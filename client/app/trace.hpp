#pragma once

#include <absl/status/statusor.h>

#include <cstdio>
#include <memory>
#include <string>

#include "client/view/desk_view.hpp"
#include "client/view/layout.hpp"

namespace saccade::app {

/// A JSON line before each picture is drawn and one when it is on the screen: which frame, where
/// its pixels stand, what the interface says. For tests and reports; nothing reads it here.
class Trace {
 public:
  ///   Unavailable  the file cannot be written
  static absl::StatusOr<std::unique_ptr<Trace>> Create(const std::string& file);
  ~Trace();
  Trace(const Trace&) = delete;
  Trace& operator=(const Trace&) = delete;

  void Drawing();
  void Shown(const view::Desk& desk, const view::DeskView& view, const view::Layout& layout,
             std::size_t tab, Timestamp shown_ns);

 private:
  explicit Trace(std::FILE* file) : file_(file) {}
  void Write(const std::string& line);

  std::FILE* file_;
  std::uint64_t sequence_ = 0;
};

}  // namespace saccade::app
