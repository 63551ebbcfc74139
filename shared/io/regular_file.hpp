#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstddef>
#include <filesystem>
#include <string>

namespace saccade {

/// The whole of `file`, which must be a regular file of at most `max_bytes`. Never waits for
/// another process: a pipe, a device, a socket or a folder is refused before it is opened. Messages
/// name the file, the problem and the remedy; `kind` is what was expected there, for example "a
/// picture".
///   NotFound           no such file
///   PermissionDenied   may not be read
///   InvalidArgument    not a regular file, or too long
///   ResourceExhausted  no file descriptor is free (of the process or the machine): try again later
///   DataLoss           reading failed, or there is no memory for it
absl::StatusOr<std::string> ReadRegularFile(const std::filesystem::path& file,
                                            std::size_t max_bytes, absl::string_view kind);

/// As std::filesystem::exists, but an error (no permission, a name too long) is yes: opening the
/// file then says what is wrong, where exists() would throw.
bool MayExist(const std::filesystem::path& file);

}  // namespace saccade
