#include "server/store/scene_store.hpp"

#include <absl/strings/str_cat.h>
#include <sys/stat.h>

#include "server/scene/scene_file.hpp"
#include "server/store/sqlite.hpp"

namespace saccade {
namespace {

constexpr const char* kSchema =
    "CREATE TABLE IF NOT EXISTS objects (id TEXT PRIMARY KEY, json TEXT NOT NULL) WITHOUT ROWID;"
    "CREATE TABLE IF NOT EXISTS models (id TEXT PRIMARY KEY, name TEXT NOT NULL, glb BLOB NOT "
    "NULL);"
    "PRAGMA user_version = 1";

absl::Status Damaged(const std::filesystem::path& file, const std::string& what) {
  return absl::DataLossError(absl::StrCat(file.string(), ": ", what,
                                          " is damaged; restore the file, or move it away and "
                                          "start with an empty scene"));
}

}  // namespace

struct SceneStore::Impl {
  std::filesystem::path file;
  std::unique_ptr<SqliteDatabase> database;
};

SceneStore::SceneStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SceneStore::~SceneStore() = default;

absl::StatusOr<std::unique_ptr<SceneStore>> SceneStore::Open(
    const std::filesystem::path& directory) {
  auto impl = std::make_unique<Impl>();
  impl->file = directory / "scene.sqlite";
  absl::StatusOr<std::unique_ptr<SqliteDatabase>> database = SqliteDatabase::Open(impl->file);
  if (!database.ok()) return database.status();
  impl->database = *std::move(database);
  chmod(impl->file.c_str(), S_IRUSR | S_IWUSR);
  const absl::StatusOr<std::string> version = impl->database->Query("PRAGMA user_version");
  if (!version.ok()) return version.status();
  if (*version != "0" && *version != "1") {
    return absl::FailedPreconditionError(absl::StrCat(
        impl->file.string(), ": written by a newer version; run that, or move the file away"));
  }
  for (const char* sql : {"PRAGMA busy_timeout = 2000", "PRAGMA journal_mode = WAL",
                          "PRAGMA synchronous = FULL", kSchema}) {
    if (absl::Status done = impl->database->Execute(sql); !done.ok()) return done;
  }
  const absl::StatusOr<std::string> check = impl->database->Query("PRAGMA quick_check(1)");
  if (!check.ok()) return check.status();
  if (*check != "ok") return Damaged(impl->file, *check);
  return std::unique_ptr<SceneStore>(new SceneStore(std::move(impl)));
}

absl::StatusOr<SceneStore::Stored> SceneStore::LoadAll() {
  Stored stored;
  absl::StatusOr<SqliteStatement> objects =
      impl_->database->Prepare("SELECT id, json FROM objects ORDER BY id");
  if (!objects.ok()) return objects.status();
  absl::StatusOr<bool> more = objects->Step();
  for (; more.ok() && *more; more = objects->Step()) {
    absl::StatusOr<std::vector<SceneObject>> read = ParseSceneObjects(objects->Text(1));
    if (!read.ok() || read->size() != 1) {
      return Damaged(impl_->file, absl::StrCat("object ", objects->Text(0)));
    }
    read->front().id = objects->Text(0);
    stored.objects.push_back(std::move(read->front()));
  }
  if (!more.ok()) return more.status();
  absl::StatusOr<SqliteStatement> models =
      impl_->database->Prepare("SELECT id, name, glb FROM models ORDER BY id");
  if (!models.ok()) return models.status();
  for (more = models->Step(); more.ok() && *more; more = models->Step()) {
    stored.models.push_back({models->Text(0), models->Text(1), models->Bytes(2)});
  }
  if (!more.ok()) return more.status();
  return stored;
}

absl::Status SceneStore::PutObject(const SceneObject& object) {
  absl::StatusOr<SqliteStatement> put =
      impl_->database->Prepare("INSERT OR REPLACE INTO objects (id, json) VALUES (?, ?)");
  if (!put.ok()) return put.status();
  put->Bind(0, std::string_view(object.id));
  put->Bind(1, std::string_view(SceneToJson({object})));
  return put->Run();
}

absl::Status SceneStore::RemoveObject(const std::string& id) {
  absl::StatusOr<SqliteStatement> removed =
      impl_->database->Prepare("DELETE FROM objects WHERE id = ?");
  if (!removed.ok()) return removed.status();
  removed->Bind(0, std::string_view(id));
  return removed->Run();
}

absl::Status SceneStore::PutModel(const StoredModel& model) {
  absl::StatusOr<SqliteStatement> put =
      impl_->database->Prepare("INSERT OR REPLACE INTO models (id, name, glb) VALUES (?, ?, ?)");
  if (!put.ok()) return put.status();
  put->Bind(0, std::string_view(model.id));
  put->Bind(1, std::string_view(model.name));
  put->BindBytes(2, model.bytes);
  return put->Run();
}

}  // namespace saccade
