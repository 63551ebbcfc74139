#include "server/anchors/anchor_options.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

namespace saccade {
namespace {

std::uint64_t Hash(std::uint64_t hash, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 1099511628211ULL;  // FNV-1a
  return hash;
}

}  // namespace

absl::Status AnchorOptions::Validate() const {
  const auto positive = [](const char* name, double value) {
    return value > 0 ? absl::OkStatus()
                     : absl::InvalidArgumentError(
                           absl::StrFormat("anchors.%s is %g; give a number above 0", name, value));
  };
  if (cluster_size < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("anchors.cluster_size is ", cluster_size, "; give 1 or more"));
  }
  const auto some = [](const char* name, std::size_t value) {
    return value > 0 ? absl::OkStatus()
                     : absl::InvalidArgumentError(
                           absl::StrCat("anchors.", name, " is 0; give a number above 0"));
  };
  for (const absl::Status& status : {some("max_annotations", max_annotations),
                                     some("max_ink_points", max_ink_points),
                                     some("max_bytes", max_bytes),
                                     some("max_session_annotations", max_session_annotations),
                                     some("max_session_ink_points", max_session_ink_points),
                                     some("max_picture_bytes", max_picture_bytes),
                                     some("max_person_picture_bytes", max_person_picture_bytes),
                                     some("max_undo_bytes", max_undo_bytes),
                                     some("max_undo_bytes_all", max_undo_bytes_all),
                                     positive("cluster_softening_m", cluster_softening_m),
                                     positive("feature_radius_px", feature_radius_px),
                                     positive("plane_residual_m", plane_residual_m),
                                     positive("plane_residual_relative", plane_residual_relative),
                                     positive("median_depth_sigma", median_depth_sigma),
                                     positive("click_sigma_px", click_sigma_px),
                                     positive("tracking_sigma", tracking_sigma),
                                     positive("pause_sigma_m", pause_sigma_m),
                                     positive("pause_sigma_px", pause_sigma_px),
                                     positive("pause_sigma_no_scale", pause_sigma_no_scale),
                                     positive("resume_share", resume_share),
                                     positive("resume_time_s", resume_time_s),
                                     positive("far_depth_sigma", far_depth_sigma),
                                     positive("moved_m", moved_m),
                                     positive("refine_time_s", refine_time_s)}) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

std::string WorldKey(const Target& target) {
  if (const auto* board = std::get_if<ChessboardTarget>(&target)) {
    return absl::StrFormat("chessboard %dx%d %g m", board->columns, board->rows, board->square_m);
  }
  const auto& patches = std::get<PatchTarget>(target);
  std::uint64_t hash = 14695981039346656037ULL;
  for (const KnownPatch& patch : patches.points) {
    hash = Hash(hash, patch.point_in_world.data(), 3 * sizeof(double));
    for (int row = 0; row < patch.templ.rows; ++row) {
      hash = Hash(hash, patch.templ.ptr(row), patch.templ.cols * patch.templ.elemSize());
    }
  }
  return absl::StrFormat("patches %d %016x", patches.points.size(), hash);
}

}  // namespace saccade
