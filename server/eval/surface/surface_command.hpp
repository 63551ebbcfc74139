#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>

#include "server/eval/commands.hpp"

namespace CLI {
class App;
}

namespace saccade {

struct SurfaceArguments {
  std::string source;  // sim:..., or...
  std::filesystem::path dataset, out;
  double seconds = 0;  // of the source; 0: to its end
  int pictures = 4;    // of the mesh beside what a keyframe saw
  TrackerArguments tracker;
};

void AddSurface(CLI::App& app, SurfaceArguments& arguments);

/// Tracks a source and finds the surfaces that its keyframes show: mesh.ply, pictures of it beside
/// what the camera saw, report.json, which is also printed: cost, memory and, of the simulator, how
/// right it is (ScoreSurface).
absl::Status SurfaceCommand(const SurfaceArguments& arguments);

}  // namespace saccade
