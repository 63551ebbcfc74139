#include "client/session/pointer_book.hpp"

#include <algorithm>

namespace saccade::session {
namespace {

constexpr Timestamp kSilentNs = 1'500'000'000;

}  // namespace

void PointerBook::Apply(const std::vector<net::PointerNews>& news, const std::string& me,
                        Timestamp now_ns) {
  for (const net::PointerNews& each : news) {
    if (each.participant_id == me) continue;
    const std::string key = each.participant_id + (each.sketch ? " sketch" : " laser");
    const auto before = known_.find(key);
    const bool same = before != known_.end() && before->second.stroke_id == each.stroke_id;
    if (each.released) {
      if (same) known_.erase(before);
      continue;
    }
    if (each.points_in_world.empty()) continue;
    OthersPointer& pointer = known_[key];
    if (!same) pointer.points_in_world.clear();
    pointer.name = each.display_name;
    pointer.stroke_id = each.stroke_id;
    pointer.sketch = each.sketch;
    pointer.color_rgba = each.color_rgba == 0 ? 0xffffffff : each.color_rgba;
    pointer.heard_ns = now_ns;
    std::vector<Eigen::Vector3d>& points = pointer.points_in_world;
    if (!each.sketch) {
      points = {each.points_in_world.back()};
      continue;
    }
    if (each.first < points.size()) points.resize(each.first);  // what is there was told again
    points.insert(points.end(), each.points_in_world.begin(), each.points_in_world.end());
  }
}

bool PointerBook::Expire(Timestamp now_ns) {
  return std::erase_if(known_, [now_ns](const auto& entry) {
           return now_ns - entry.second.heard_ns > kSilentNs;
         }) > 0;
}

std::vector<OthersPointer> PointerBook::List() const {
  std::vector<OthersPointer> all;
  for (const auto& [key, pointer] : known_) all.push_back(pointer);
  return all;
}

std::size_t PointerBook::lasers() const {
  return static_cast<std::size_t>(std::count_if(
      known_.begin(), known_.end(), [](const auto& entry) { return !entry.second.sketch; }));
}

}  // namespace saccade::session
