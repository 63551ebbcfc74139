#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

#include "server/anchors/stored_annotation.hpp"
#include "server/store/sqlite.hpp"

namespace saccade {

// What of annotations lies in tables of its own: the files of pictures, by their hash; the lines of
// check lists; the highest number that a pin had. Inside the caller's transaction.

/// Of what a change leaves (nothing: it was deleted), all but its row.
absl::Status WriteParts(SqliteDatabase& database, const AnnotationChange& change);

/// Forgets the files that no row names.
absl::Status DropUnusedPictures(SqliteDatabase& database);

/// Fills in picture (`picture_sha256`; empty: none) and lines; false: what is there makes no sense.
absl::StatusOr<bool> ReadParts(SqliteDatabase& database, const std::string& picture_sha256,
                               Annotation& annotation);

absl::StatusOr<std::uint32_t> ReadLastPin(SqliteDatabase& database);

}  // namespace saccade
