#include "client/view/painter.hpp"

#include <algorithm>
#include <cmath>

#include "client/view/theme.hpp"
#include "client/view/typesetter.hpp"

namespace saccade::view {
namespace {

constexpr float kMaxRing = 120;
constexpr float kMostOfWidth = 0.6f;  // a longer label hides more than it says
constexpr float kLetter = 7.5f;       // about as wide

bool Contains(const std::vector<std::string>& ids, const std::string& id) {
  return !id.empty() && std::find(ids.begin(), ids.end(), id) != ids.end();
}

/// Its first characters; of a long one fewer than 40, however wide the pane.
std::string Shortened(const std::string& text, float room) {
  const std::size_t most = static_cast<std::size_t>(std::clamp(room, 8.0f, 40.0f));
  std::size_t count = 0, end = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if ((static_cast<unsigned char>(text[i]) & 0xc0) == 0x80) continue;
    if (++count == most) end = i;
  }
  return count <= most ? text : text.substr(0, end) + "…";
}

std::vector<ImVec2> Circle(ImVec2 centre, float radius) {
  std::vector<ImVec2> points;
  const int count = std::clamp(static_cast<int>(radius * 2), 12, 96);
  for (int i = 0; i <= count; ++i) {
    const float angle = 6.2831853f * static_cast<float>(i) / static_cast<float>(count);
    points.push_back({centre.x + radius * std::cos(angle), centre.y + radius * std::sin(angle)});
  }
  return points;
}

}  // namespace

Painter::Painter(ImDrawList* list, const Rect& pane, float left, float top, float scale, float unit)
    : list_(list), pane_(pane), left_(left), top_(top), scale_(scale), unit_(unit) {
  list_->PushClipRect({pane.x, pane.y}, {pane.right(), pane.bottom()}, true);
}
Painter::~Painter() { list_->PopClipRect(); }

ImVec2 Painter::At(const Eigen::Vector2d& pixel) const {
  return {left_ + (static_cast<float>(pixel.x()) + 0.5f) * scale_,
          top_ + (static_cast<float>(pixel.y()) + 0.5f) * scale_};
}

float Painter::thinning() const { return std::clamp(scale_ / unit_, 0.6f, 1.1f); }

void Painter::Stroke(const std::vector<ImVec2>& points, ImU32 color, float width, bool closed) {
  list_->AddPolyline(points.data(), static_cast<int>(points.size()), color,
                     closed ? ImDrawFlags_Closed : 0, width * unit_);
}

void Painter::Dashes(const std::vector<ImVec2>& points, ImU32 color, float width, float dash) {
  const float step = dash * unit_;
  float along = 0;  // of the whole line
  for (std::size_t i = 1; i < points.size(); ++i) {
    const ImVec2 a = points[i - 1], b = points[i];
    const float length = std::hypot(b.x - a.x, b.y - a.y);
    for (float from = 0; from < length;) {
      const float in_cycle = std::fmod(along + from, 2 * step);
      const bool drawn = in_cycle < step;
      const float to =
          std::min(length, from + (drawn ? step - in_cycle : 2 * step - in_cycle) + 1e-3f);
      const auto on = [&](float t) {
        return ImVec2(a.x + (b.x - a.x) * t / length, a.y + (b.y - a.y) * t / length);
      };
      if (drawn) list_->AddLine(on(from), on(to), color, width * unit_);
      from = to;
    }
    along += length;
  }
}

void Painter::Laser(const Eigen::Vector2d& pixel, ImU32 color, const std::string& name) {
  const ImVec2 at = At(pixel);
  const float size = unit_ * thinning();
  list_->AddCircleFilled(at, 7 * size, kHalo);
  list_->AddCircleFilled(at, 4 * size, color);
  list_->AddCircleFilled(at, 1.5f * size, kWhite);
  Words({at.x + 11 * size, at.y}, name, color);
}

void Painter::Handle(const Eigen::Vector2d& pixel) {
  const ImVec2 at = At(pixel);
  for (const auto& [color, width] : {std::pair(kHalo, 5.0f), std::pair(kAccent, 2.0f)}) {
    list_->AddCircle(at, 5 * unit_, color, 16, width * unit_);
    list_->PathArcTo(at, 11 * unit_, -2.4f, -0.7f, 12);
    list_->PathStroke(color, 0, width * unit_);
  }
}

void Painter::Area(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const ImVec2 a = At(from.cwiseMin(to)), c = At(from.cwiseMax(to));
  list_->AddRectFilled(a, c, IM_COL32(0xc4, 0xb0, 0xff, 36));
  const std::vector<ImVec2> edge = {a, {c.x, a.y}, c, {a.x, c.y}, a};
  Stroke(edge, kHalo, 4);
  Dashes(edge, kAccent, 1.6f, 6);
}

void Painter::Image(unsigned texture, const std::array<Eigen::Vector2d, 4>& corners, ImVec2 first,
                    ImVec2 last) {
  list_->AddImageQuad(reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture)),
                      At(corners[0]), At(corners[1]), At(corners[2]), At(corners[3]), first,
                      {last.x, first.y}, last, {first.x, last.y});
}

void Painter::Line(const Polyline2& line, ImU32 color, bool dashed) {
  std::vector<ImVec2> points;
  for (const Eigen::Vector2d& pixel : line) points.push_back(At(pixel));
  if (dashed) {
    Dashes(points, color, 2, 5);
  } else {
    Stroke(points, color, 2);
  }
}

void Painter::Draw(const Marks& marks, const std::vector<std::string>& accented) {
  std::vector<ImVec2> points;
  for (const saccade::Stroke& stroke : marks.strokes) {
    points.clear();
    for (const Eigen::Vector2d& pixel : stroke.points_px) points.push_back(At(pixel));
    Stroke(points, kHalo, 5);
  }
  for (const bool above : {false, true}) {
    for (const saccade::Stroke& stroke : marks.strokes) {
      if (Contains(accented, stroke.annotation_id) != above) continue;
      Line(stroke.points_px, above ? kAccent : ColorOf(stroke.color_rgba), stroke.hollow);
    }
  }
  std::vector<Rect> taken;  // newest first
  for (auto label = marks.labels.rbegin(); label != marks.labels.rend(); ++label) {
    if (!Contains(accented, label->annotation_id)) {
      Tag(*label, ColorOf(label->color_rgba), false, &taken);
    }
  }
  for (const Label& label : marks.labels) {
    if (Contains(accented, label.annotation_id)) Tag(label, kAccent, true, nullptr);
  }
}

void Painter::Tag(const Label& label, ImU32 color, bool whole, std::vector<Rect>* taken) {
  std::string text = label.text;
  std::replace(text.begin(), text.end(), '\n', ' ');
  if (!whole) text = Shortened(text, kMostOfWidth * pane_.width / (kLetter * unit_));
  const float inset = 6 * unit_;
  const float wrap = whole ? std::min(300 * unit_, pane_.width - 4 * inset) : 0.0f;
  text = Types().Set(text, wrap);
  ImFont* font = ImGui::GetFont();
  const float size = ImGui::GetFontSize();
  const ImVec2 extent = font->CalcTextSizeA(size, 1e6f, wrap, text.c_str());
  const ImVec2 at = At(label.at_px);
  Rect box{at.x + inset, at.y - extent.y - 8 * unit_, extent.x + 2 * inset, extent.y + 4 * unit_};
  const bool in_view = at.x > pane_.x && at.x < pane_.right();
  if (whole || in_view) {
    box.x = std::clamp(box.x, pane_.x, std::max(pane_.x, pane_.right() - box.width));
  }
  if (whole) {
    box.y = std::clamp(box.y, pane_.y, std::max(pane_.y, pane_.bottom() - box.height));
  }
  if (taken != nullptr) {
    for (const Rect& other : *taken) {
      if (box.x < other.right() && other.x < box.right() && box.y < other.bottom() &&
          other.y < box.bottom()) {
        return;
      }
    }
    taken->push_back(box);
  }
  const ImVec2 from{box.x, box.y}, to{box.right(), box.bottom()};
  list_->AddRectFilled(from, to, IM_COL32(16, 17, 18, 220), 4 * unit_);
  if (label.hollow) {
    Dashes({from, {to.x, from.y}, to, {from.x, to.y}, from}, color, 1.5f, 4);
  } else {
    list_->AddRect(from, to, color, 4 * unit_, 0, 1.5f * unit_);
  }
  list_->AddText(font, size, {box.x + inset, box.y + 2 * unit_}, color, text.c_str(), nullptr,
                 wrap);
}

void Painter::EdgeArrows(const std::vector<EdgeArrow>& arrows,
                         const std::vector<std::string>& accented) {
  const float size = unit_ * thinning();
  for (const EdgeArrow& arrow : arrows) {
    const ImVec2 tip = At(arrow.tip_px);
    const float du = static_cast<float>(arrow.direction.x()) * size;
    const float dv = static_cast<float>(arrow.direction.y()) * size;
    const ImVec2 left{tip.x - 18 * du - 10 * dv, tip.y - 18 * dv + 10 * du};
    const ImVec2 right{tip.x - 18 * du + 10 * dv, tip.y - 18 * dv - 10 * du};
    Stroke({tip, left, right}, kHalo, 6, true);
    const ImU32 color =
        Contains(accented, arrow.annotation_id) ? kAccent : ColorOf(arrow.color_rgba);
    if (!arrow.hollow) list_->AddTriangleFilled(tip, left, right, color);
    Stroke({tip, left, right}, color, 2, true);
  }
}

void Painter::Feature(const Eigen::Vector2d& pixel, FeatureState state) {
  const ImVec2 at = At(pixel);
  const float r = 3.5f * unit_ * thinning();
  const ImU32 color = ColorOf(state);
  switch (state) {
    case FeatureState::kMeasured:
      list_->AddCircleFilled(at, r + 1.5f * unit_, kHalo, 12);
      list_->AddCircleFilled(at, r, color, 12);
      break;
    case FeatureState::kNotAttempted:
      list_->AddCircle(at, r, kHalo, 12, 4 * unit_);
      list_->AddCircle(at, r, color, 12, 1.8f * unit_);
      break;
    case FeatureState::kFailed:
      for (const auto& [line, width] : {std::pair(kHalo, 4.0f), std::pair(color, 1.8f)}) {
        list_->AddLine({at.x - r, at.y - r}, {at.x + r, at.y + r}, line, width * unit_);
        list_->AddLine({at.x + r, at.y - r}, {at.x - r, at.y + r}, line, width * unit_);
      }
      break;
  }
}

void Painter::Target(const Eigen::Vector2d& pixel, bool held, const std::string& words) {
  const ImVec2 at = At(pixel);
  const float r = 13 * unit_ * thinning();
  const std::vector<ImVec2> ring = Circle(at, r);
  for (const auto& [color, width] : {std::pair(kHalo, 5.5f), std::pair(kTarget, 2.5f)}) {
    if (held || color == kHalo) {
      Stroke(ring, color, width);
    } else {
      Dashes(ring, color, width, 4);
    }
    for (const ImVec2 d : {ImVec2(1, 0), ImVec2(0, 1), ImVec2(-1, 0), ImVec2(0, -1)}) {
      list_->AddLine({at.x + d.x * r * 0.55f, at.y + d.y * r * 0.55f},
                     {at.x + d.x * r * 1.55f, at.y + d.y * r * 1.55f}, color, width * unit_);
    }
  }
  const float width = ImGui::CalcTextSize(Types().Set(words).c_str()).x;
  const bool left = at.x + r * 1.7f + width > pane_.right();
  Words({left ? at.x - r * 1.7f - width : at.x + r * 1.7f, at.y + r * 1.3f}, words, kTarget);
}

void Painter::Centre(const Eigen::Vector2d& pixel) {
  const ImVec2 at = At(pixel);
  const float arm = 5 * unit_;
  for (const auto& [color, width] : {std::pair(kHalo, 4.0f), std::pair(kWhite, 1.5f)}) {
    list_->AddLine({at.x - arm, at.y}, {at.x + arm, at.y}, color, width * unit_);
    list_->AddLine({at.x, at.y - arm}, {at.x, at.y + arm}, color, width * unit_);
  }
}

void Painter::Axes(const std::array<AxisStroke, 3>& axes) {
  for (const AxisStroke& axis : axes) {
    for (const Polyline2& piece : axis.pieces) {
      std::vector<ImVec2> points;
      for (const Eigen::Vector2d& pixel : piece) points.push_back(At(pixel));
      Stroke(points, kHalo, 4);
      Stroke(points, kAxis, 1.5f);
    }
  }
  for (const AxisStroke& axis : axes) {
    if (!axis.end_px) continue;
    const ImVec2 at = At(*axis.end_px);
    Words({at.x + 5 * unit_, at.y}, std::string(1, axis.name), kAxis);
  }
}

void Painter::Ring(const Eigen::Vector2d& pixel, std::optional<double> radius_px,
                   const std::string& words) {
  const ImVec2 at = At(pixel);
  const float size = static_cast<float>(radius_px.value_or(0)) * scale_;
  const float r = std::clamp(size, 5 * unit_, kMaxRing * unit_);
  const std::vector<ImVec2> ring = Circle(at, r);
  Stroke(ring, kHalo, 4);
  // Dashed: not to scale, the words say how large.
  if (!radius_px || size > r) {
    Dashes(ring, kAccent, 1.6f, 3.5f);
  } else {
    Stroke(ring, kAccent, 1.6f);
  }
  list_->AddCircleFilled(at, 1.6f * unit_, kAccent);
  Words({at.x + r + 7 * unit_, at.y}, words, kWhite);
}

void Painter::Words(ImVec2 at, const std::string& written, ImU32 color) {
  if (written.empty()) return;
  const std::string words = Types().Set(written);
  const float y = at.y - 0.5f * ImGui::GetFontSize();
  for (const float dx : {-1.3f, 0.0f, 1.3f}) {
    for (const float dy : {-1.3f, 0.0f, 1.3f}) {
      if (dx == 0 && dy == 0) continue;
      list_->AddText({at.x + dx * unit_, y + dy * unit_}, IM_COL32(0, 0, 0, 90), words.c_str());
    }
  }
  list_->AddText({at.x, y}, color, words.c_str());
}

}  // namespace saccade::view
