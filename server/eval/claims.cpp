#include "server/eval/claims.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "server/eval/output_file.hpp"
#include "server/eval/statistics.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kEvery_s = 1.0;
constexpr double kBeyond = 3.0;  // sigma
constexpr double kFar_m = 0.05;
constexpr double kSoon_s = 3.0;

const Annotation* Find(const std::vector<Annotation>& annotations, const std::string& id) {
  const auto same = [&id](const Annotation& each) { return each.id == id; };
  const auto found = std::find_if(annotations.begin(), annotations.end(), same);
  return found == annotations.end() ? nullptr : &*found;
}

Claim MakeClaim(const PlacedAnchor& placed, const Anchor& anchor, const ClaimFrame& frame,
                bool seen) {
  Claim claim;
  claim.placed = placed;
  claim.time_s = frame.time_s;
  claim.posed = frame.posed && anchor.place_known;
  claim.metric = frame.metric;
  claim.state = anchor.state;
  claim.method = anchor.method;
  claim.claimed = anchor.error_m;
  claim.claimed_px = anchor.error_px;
  claim.estimate_in_camera = frame.world_from_camera.Inverse() * anchor.point_in_world;
  claim.true_in_camera = frame.true_world_from_camera.Inverse() * placed.true_point;
  claim.reason = anchor.reason;
  const auto truth = frame.camera->Project(claim.true_in_camera);
  const auto estimate = frame.camera->Project(claim.estimate_in_camera);
  if (seen && truth && estimate) claim.error_px = (*estimate - *truth).norm();
  return claim;
}

std::string OrEmpty(const std::optional<double>& value) {
  return value ? absl::StrFormat("%.3f", *value) : "";
}

/// Share beyond 3 sigma and median of ratios.
Json Summary(const std::vector<double>& ratios) {
  Sample sample;
  std::size_t beyond = 0;
  for (const double ratio : ratios) {
    sample.Add(ratio);
    if (!(ratio <= kBeyond)) ++beyond;
  }
  Json out;
  out["sightings"] = ratios.size();
  out["beyond_3_sigma"] =
      ratios.empty() ? Json(nullptr)
                     : Json(static_cast<double>(beyond) / static_cast<double>(ratios.size()));
  out["median_error_over_claim"] = ratios.empty() ? Json(nullptr) : Json(sample.Percentile(50));
  return out;
}

}  // namespace

const char* ToString(AnchorMethod method) {
  constexpr const char* kNames[] = {"scene", "feature", "plane", "median depth", "point"};
  return kNames[static_cast<int>(method)];
}

const char* ToString(AnchorState state) {
  constexpr const char* kNames[] = {"provisional", "tracking", "paused", "stopped"};
  return kNames[static_cast<int>(state)];
}

void ClaimLog::Observe(const ClaimFrame& frame, const std::vector<Annotation>& annotations,
                       const std::function<bool(const Eigen::Vector3d&)>& sees) {
  const bool due = frame.time_s >= next_s_;
  if (due) next_s_ = std::floor(frame.time_s / kEvery_s + 1e-6) * kEvery_s + kEvery_s - 1e-6;
  for (Watched& watched : placed_) {
    const Annotation* annotation = Find(annotations, watched.placed.id);
    if (annotation == nullptr) continue;
    if (!watched.trusted_s && annotation->anchor.state == AnchorState::kTracking) {
      watched.trusted_s = frame.time_s - watched.placed.time_s;
    }
    if (!due) continue;
    claims_.push_back(
        MakeClaim(watched.placed, annotation->anchor, frame, sees(watched.placed.true_point)));
  }
}

std::size_t ClaimLog::TrustedWithin(double seconds) const {
  return static_cast<std::size_t>(std::count_if(
      placed_.begin(), placed_.end(),
      [seconds](const Watched& each) { return each.trusted_s && *each.trusted_s <= seconds; }));
}

absl::Status ClaimLog::Write(const std::filesystem::path& file, double scale) const {
  // Millimetres are claimed of maps with metres alone; of the others, a share of the distance.
  std::string text =
      "time_s,anchor,state,method,age_s,posed,metric,claimed_mm,error_mm,claimed_px,error_px,"
      "claimed_percent,error_percent,placed_s,placed_u_px,placed_v_px,placed_range_m,outline,"
      "reason\n";
  for (const Claim& claim : claims_) {
    const double claimed = scale * claim.claimed, error = claim.ErrorM(scale);
    const double distance = claim.true_in_camera.norm();
    std::string reason = claim.reason;
    std::replace(reason.begin(), reason.end(), '"', '\'');
    absl::StrAppendFormat(
        &text, "%.2f,%d,%s,%s,%.2f,%d,%d,%s,%.2f,%s,%s,%.3f,%.3f,%.2f,%.1f,%.1f,%.3f,%d,\"%s\"\n",
        claim.time_s, claim.placed.number, ToString(claim.state), ToString(claim.method),
        claim.age_s(), claim.posed ? 1 : 0, claim.metric ? 1 : 0,
        claim.metric ? absl::StrFormat("%.2f", 1e3 * claimed) : "", 1e3 * error,
        OrEmpty(claim.claimed_px), OrEmpty(claim.error_px), 1e2 * claimed / distance,
        1e2 * error / distance, claim.placed.time_s, claim.placed.pixel.x(), claim.placed.pixel.y(),
        claim.placed.range_m, claim.placed.outline ? 1 : 0, reason);
  }
  return WriteFileAtomically(file, text);
}

void ClaimTotals::Add(const ClaimLog& log, double scale) {
  anchors_ += log.anchors();
  trusted_within_3s_ += log.TrustedWithin(kSoon_s);
  std::vector<int> far, far_unsaid;
  const auto note = [](int number, std::vector<int>& list) {
    if (std::find(list.begin(), list.end(), number) == list.end()) list.push_back(number);
  };
  for (const Claim& claim : log.claims()) {
    if (!claim.posed) continue;
    ++sightings_;
    if (claim.state != AnchorState::kTracking) continue;
    const double error = claim.ErrorM(scale);
    Row row{claim.method, claim.placed.outline, claim.age_s(),
            error / std::max(1e-9, scale * claim.claimed), std::nullopt};
    if (claim.error_px && claim.claimed_px) {
      row.ratio_px = *claim.error_px / std::max(1e-9, *claim.claimed_px);
    }
    tracking_.push_back(row);
    if (error <= kFar_m) continue;
    note(claim.placed.number, far);
    if (row.ratio_m > kBeyond) note(claim.placed.number, far_unsaid);
  }
  far_ += far.size();
  far_unsaid_ += far_unsaid.size();
}

void ClaimTotals::Add(const ClaimTotals& other) {
  tracking_.insert(tracking_.end(), other.tracking_.begin(), other.tracking_.end());
  sightings_ += other.sightings_;
  anchors_ += other.anchors_;
  trusted_within_3s_ += other.trusted_within_3s_;
  far_ += other.far_;
  far_unsaid_ += other.far_unsaid_;
}

nlohmann::ordered_json ClaimTotals::Report() const {
  const auto by = [this](auto&& belongs) {
    std::vector<double> metres, pixels;
    for (const Row& row : tracking_) {
      if (!belongs(row)) continue;
      metres.push_back(row.ratio_m);
      if (row.ratio_px) pixels.push_back(*row.ratio_px);
    }
    return Json{{"length", Summary(metres)}, {"px", Summary(pixels)}};
  };
  Json report;
  report["anchors"] = anchors_;
  report["tracking_within_3s"] =
      anchors_ == 0 ? Json(nullptr)
                    : Json(static_cast<double>(trusted_within_3s_) / static_cast<double>(anchors_));
  report["sightings"] = sightings_;
  report["tracking"] = by([](const Row&) { return true; });
  report["far_anchors"] = far_;                // more than 5 cm off at some time while tracking
  report["far_unsaid_anchors"] = far_unsaid_;  // and more than 3 sigma
  for (const AnchorMethod method :
       {AnchorMethod::kScene, AnchorMethod::kFeature, AnchorMethod::kPlane,
        AnchorMethod::kMedianDepth, AnchorMethod::kPoint}) {
    Json each = by([method](const Row& row) { return row.method == method; });
    if (each["length"]["sightings"] != 0) report["by_method"][ToString(method)] = std::move(each);
  }
  constexpr double kAges_s[] = {0, 1, 3, 10, 30, 1e9};
  for (int k = 0; k + 1 < 6; ++k) {
    const double from = kAges_s[k], to = kAges_s[k + 1];
    const std::string name =
        to > 1e8 ? absl::StrFormat("from %g s", from) : absl::StrFormat("%g to %g s", from, to);
    report["by_age"][name] =
        by([from, to](const Row& row) { return row.age_s >= from && row.age_s < to; });
  }
  report["on_outlines"] = by([](const Row& row) { return row.outline; });
  return report;
}

}  // namespace saccade
