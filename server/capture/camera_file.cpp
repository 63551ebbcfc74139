#include "server/capture/camera_file.hpp"

#include <absl/strings/str_cat.h>

#include <string>
#include <vector>

#include "server/capture/camera_files/forms.hpp"
#include "server/capture/camera_files/plausibility.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

const CameraForm& FormOf(const CameraDocument& document) {
  const std::span<const CameraForm> forms = CameraForms();
  for (const CameraForm& form : forms) {
    if (form.recognises(document)) return form;
  }
  return forms.back();
}

absl::Status CompleteSize(const PictureSize& picture_size, CameraDraft& draft) {
  if (draft.lens.width != 0 || draft.lens.height != 0) return absl::OkStatus();
  const std::optional<cv::Size> size = picture_size ? picture_size() : std::nullopt;
  if (!size) {
    return draft.Error("width", absl::StrCat("the pictures' size is not in this file (", draft.form,
                                             ") and not known yet"));
  }
  draft.lens.width = size->width;
  draft.lens.height = size->height;
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<CameraIntrinsics> LoadCamera(const std::filesystem::path& file,
                                            const PictureSize& picture_size) {
  absl::StatusOr<CameraDocument> document = LoadCameraDocument(file);
  if (!document.ok()) return document.status();
  const CameraForm& form = FormOf(*document);
  const bool foreign = &form != &CameraForms().back();
  CameraDraft draft;
  draft.file = document->file;
  draft.form = std::string(form.name);
  absl::Status status = form.read(*document, draft);
  if (status.ok()) status = CompleteSize(picture_size, draft);
  std::vector<std::string> warnings;
  if (status.ok()) status = CheckPlausible(draft, warnings);
  if (!status.ok()) {
    if (!foreign) return status;
    // All of it at once, so that nobody has to come back for the next error.
    return absl::Status(status.code(), absl::StrCat(status.message(), ". Read as ", form.name,
                                                    "; as a camera.yaml it is ", CameraLine(draft),
                                                    ": save that, corrected, and give it"));
  }
  for (const std::string& warning : warnings) Log(warning);
  if (foreign) {
    Log(absl::StrCat(draft.file, ": read as ", form.name,
                     draft.camera.empty() ? "" : absl::StrCat(", ", draft.camera), ": ",
                     CameraLine(draft)));
  }
  return draft.lens;
}

}  // namespace saccade
