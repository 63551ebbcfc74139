#include "client/app/library.hpp"

#include <system_error>

namespace saccade::app {
namespace {

std::filesystem::path ModelFolder() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path installed =
      program.parent_path().parent_path() / "share/saccade/models";
  if (!error && std::filesystem::exists(installed, error)) return installed;
  return SACCADE_MODELS;
}

}  // namespace

std::map<std::string, std::filesystem::path> LibraryModels() {
  std::map<std::string, std::filesystem::path> models;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(ModelFolder(), error)) {
    const std::filesystem::path& file = entry.path();
    if (file.extension() == ".glb") models[file.stem()] = file;
  }
  return models;
}

}  // namespace saccade::app
