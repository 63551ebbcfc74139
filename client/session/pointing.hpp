#pragma once

#include <deque>
#include <optional>
#include <string>

#include "client/net/types.hpp"

namespace saccade::session {

/// One stroke while it is drawn, as others are told of it: what is new, in order, one call at a
/// time and at most 60 a second; a hand that holds still is heard of again. Pure; the caller sends.
class Pointing {
 public:
  Pointing(std::string stroke_id, std::uint32_t color_rgba)
      : stroke_id_(std::move(stroke_id)), color_rgba_(color_rgba) {}

  void Add(const AnnotationTarget& target);
  /// It is gone for everybody, once what waits was sent.
  void End() { ended_ = true; }

  /// What is to be sent now; nothing: nothing is due. Answered() before there is more.
  std::optional<net::PointerWord> Due(Timestamp now_ns);
  void Answered() { in_flight_ = false; }
  /// Its end was sent.
  bool over() const { return over_; }

 private:
  const std::string stroke_id_;
  const std::uint32_t color_rgba_;
  std::deque<AnnotationTarget> waiting_;
  std::optional<AnnotationTarget> last_;
  Timestamp sent_ns_ = 0;
  bool in_flight_ = false, ended_ = false, over_ = false;
};

}  // namespace saccade::session
