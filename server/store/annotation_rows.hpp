#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include "server/store/annotation_store.hpp"
#include "server/store/sqlite.hpp"

namespace saccade {

/// Version of the tables that this program writes, kept in PRAGMA user_version.
inline constexpr int kSchemaVersion = 2;

/// Creates the tables or brings older ones up to date, in one transaction. FailedPrecondition if a
/// newer program wrote them; DataLoss if the file belongs to something else.
absl::Status Migrate(SqliteDatabase& database, const std::string& file);

/// Writes one change and its audit row; inside the caller's transaction.
absl::Status WriteChange(SqliteDatabase& database, const AnnotationChange& change);

/// Everything; DataLoss names the annotation whose row makes no sense.
absl::StatusOr<StoredAnnotations> ReadAll(SqliteDatabase& database, const std::string& file);

}  // namespace saccade
