#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/net/stream.hpp"

namespace saccade::session {

/// What somebody else points at or draws right now.
struct OthersPointer {
  std::string name, stroke_id;
  bool sketch = false;  // a stroke that grows; else a laser
  std::uint32_t color_rgba = 0xffffffff;
  std::vector<Eigen::Vector3d> points_in_world;  // [m]; of a laser its newest alone
  Timestamp heard_ns = 0;                        // this machine's clock
};

/// Lasers and growing strokes of the others. One thread.
class PointerBook {
 public:
  /// `me`: the participant whose own are not kept, as they are drawn before they are sent.
  void Apply(const std::vector<net::PointerNews>& news, const std::string& me, Timestamp now_ns);
  /// Forgets those that nothing was heard of for 1.5 s; true if there were any.
  bool Expire(Timestamp now_ns);
  std::vector<OthersPointer> List() const;
  std::size_t lasers() const;
  void Clear() { known_.clear(); }

 private:
  std::map<std::string, OthersPointer> known_;  // by participant and kind: each has one
};

}  // namespace saccade::session
