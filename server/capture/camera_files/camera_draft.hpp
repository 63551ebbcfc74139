#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <map>
#include <string>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What a lens model is called in `camera.yaml`, and which coefficients it has.
struct LensName {
  absl::string_view name;
  LensModel model;
  std::size_t coefficients;
  absl::string_view order;
};
/// Null if there is none of that name.
const LensName* FindLens(absl::string_view name);
const LensName& LensOf(LensModel model);

/// A camera as a file tells it, in the words of camera.yaml, before anything was checked; and where
/// the file tells it, so that messages name the file's own fields and lines.
struct CameraDraft {
  struct Place {
    std::string field;  // as the file spells it
    int line = 0;       // 0: unknown
  };
  std::string file;        // for messages
  std::string form;        // "a Kalibr camchain"
  std::string camera;      // which of several; empty: there is one
  CameraIntrinsics lens;   // width, height and fx are 0 where the file has not told them yet
  bool told_lens = false;  // model and distortion are the file's
  std::map<std::string, Place, std::less<>> places;  // by the name of camera.yaml: "fx", "width"

  /// "FILE:LINE: FIELD: problem", of a field by its name in camera.yaml.
  std::string Words(absl::string_view field, absl::string_view problem) const;
  absl::Status Error(absl::string_view field, absl::string_view problem) const;
};

/// The whole of camera.yaml in one line that can be saved as such: `{model: pinhole, width: ...}`.
/// What is not known is `?`.
std::string CameraLine(const CameraDraft& draft);
std::string CameraLine(const CameraIntrinsics& lens);

}  // namespace saccade
