#include "server/eval/output_file.hpp"

#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstring>

namespace saccade {
namespace {

absl::Status CannotWrite(absl::string_view file, int error) {
  const auto message = absl::StrCat(file, ": cannot be written (", std::strerror(error), "); ",
                                    error == ENOSPC ? "free some space" : "check the folder",
                                    " or give another --out");
  return error == ENOSPC ? absl::ResourceExhaustedError(message) : absl::UnknownError(message);
}

}  // namespace

absl::StatusOr<OutputFile> OutputFile::Create(const std::filesystem::path& file) {
  std::FILE* opened = std::fopen(file.c_str(), "wb");
  if (opened == nullptr) return CannotWrite(file.string(), errno);
  return OutputFile(opened, file.string());
}

void OutputFile::Fail() {
  if (status_.ok()) status_ = CannotWrite(name_, errno);
}

void OutputFile::Write(absl::string_view text) {
  if (!status_.ok() || file_ == nullptr) return;
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) Fail();
}

absl::Status OutputFile::Flush() {
  if (status_.ok() && file_ != nullptr && std::fflush(file_.get()) != 0) Fail();
  return status_;
}

absl::Status OutputFile::Close() {
  if (file_ != nullptr && std::fclose(file_.release()) != 0) Fail();
  return status_;
}

absl::Status WriteFileAtomically(const std::filesystem::path& file, absl::string_view text) {
  const std::filesystem::path partial = file.string() + ".part";
  absl::StatusOr<OutputFile> output = OutputFile::Create(partial);
  if (!output.ok()) return output.status();
  output->Write(text);
  absl::Status status = output->Close();
  std::error_code error;
  if (status.ok()) {
    std::filesystem::rename(partial, file, error);
    if (error) status = CannotWrite(file.string(), error.value());
  }
  if (!status.ok()) std::filesystem::remove(partial, error);
  return status;
}

absl::Status CreateFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return CannotWrite(folder.string(), error.value());
  if (!std::filesystem::is_directory(folder)) {
    return absl::AlreadyExistsError(
        absl::StrCat(folder.string(), ": is a file; give a folder as --out"));
  }
  return absl::OkStatus();
}

}  // namespace saccade
