#include "server/calibrate/camera_output.hpp"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <fstream>

#include "server/capture/camera_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

absl::Status CannotWrite(const std::filesystem::path& out) {
  return absl::NotFoundError(
      absl::StrCat("--out ", out.string(), ": cannot be written; is the folder writable?"));
}

absl::Status WriteDraft(const std::filesystem::path& draft, const std::string& text) {
  std::ofstream file(draft, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  return file ? absl::OkStatus() : CannotWrite(draft);
}

}  // namespace

absl::Status CheckCameraOut(const std::filesystem::path& out) {
  if (MayExist(out)) {
    return absl::AlreadyExistsError(
        absl::StrCat("--out: ", out.string(), " exists; name a new file"));
  }
  const std::filesystem::path folder =
      out.has_parent_path() ? out.parent_path() : std::filesystem::path(".");
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return absl::NotFoundError(absl::StrCat("--out ", out.string(), ": there is no folder ",
                                            folder.string(), "; make it"));
  }
  if (access(folder.c_str(), W_OK | X_OK) == 0) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat("--out ", out.string(),
                                                  ": nothing can be written into ", folder.string(),
                                                  "; name another folder"));
}

absl::Status WriteCameraFile(const std::filesystem::path& out, CameraTextForm form,
                             const CameraIntrinsics& lens, const std::string& comment) {
  const absl::StatusOr<std::string> text = CameraText(form, lens, comment);
  if (!text.ok()) return text.status();
  const std::filesystem::path draft = out.string() + ".draft";
  std::error_code error;
  if (absl::Status put = WriteDraft(draft, *text); !put.ok()) {
    std::filesystem::remove(draft, error);
    return put;
  }
  const absl::StatusOr<CameraIntrinsics> read = LoadCamera(draft);
  if (!read.ok()) {
    std::filesystem::remove(draft, error);
    return absl::FailedPreconditionError(absl::StrCat(
        "too little to believe: the lens found is none that can be (", read.status().message(),
        "); show the target at all edges, tilted each way, and give --lens kannala_brandt for a "
        "fisheye"));
  }
  if (MayExist(out)) {
    return absl::AlreadyExistsError(absl::StrCat("--out: ", out.string(),
                                                 " was made meanwhile and is left as it is; the "
                                                 "camera is in ",
                                                 draft.string()));
  }
  std::filesystem::rename(draft, out, error);
  return error ? CannotWrite(out) : absl::OkStatus();
}

absl::Status KeepCameraFile(const std::filesystem::path& file, const std::string& text) {
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  const std::filesystem::path draft = file.string() + ".draft";
  absl::Status kept = WriteDraft(draft, text);
  if (kept.ok()) kept = LoadCamera(draft).status();
  if (kept.ok()) {
    std::filesystem::rename(draft, file, error);
    if (!error) return absl::OkStatus();
    kept = CannotWrite(file);
  }
  std::filesystem::remove(draft, error);
  return kept;
}

}  // namespace saccade
