#pragma once

#include <absl/status/status.h>

#include <filesystem>

namespace saccade {

/// Creates `directory`, for its owner alone. One that is there already is made so if it holds
/// nothing but the store's files, and these always; what was changed is said on stderr.
absl::Status PrepareDirectory(const std::filesystem::path& directory);
void MakePrivate(const std::filesystem::path& directory);

/// Whether the data base may be opened: a regular file with something in it, or none.
absl::Status CheckDatabaseFile(const std::filesystem::path& file);

/// Creates an empty file for its owner alone, in place of one that is there.
absl::Status CreatePrivate(const std::filesystem::path& file);

/// `from` becomes `to`, and both the file and its name are on the disk when it is done.
absl::Status PublishFile(const std::filesystem::path& from, const std::filesystem::path& to);

/// A log without its data base is put aside: SQLite would mix it into the next one.
void PutAsideStrayLog(const std::filesystem::path& file);

/// errno as a status that names the file and the remedy.
absl::Status StoreFileError(const std::filesystem::path& file, int error);

}  // namespace saccade
