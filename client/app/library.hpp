#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace saccade::app {

/// The models that come with Saccade, by name: GLB files beside the installed program
/// (share/saccade/models), else of the source tree. Empty where there are none.
std::map<std::string, std::filesystem::path> LibraryModels();

}  // namespace saccade::app
