#pragma once

#include "server/eval/commands.hpp"

namespace CLI {
class App;
}

namespace saccade {

/// `saccade-eval markers` and `saccade-eval print-markers`, whose values are put there.
void AddMarkers(CLI::App& app, MarkersArguments& arguments);
void AddPrintMarkers(CLI::App& app, PrintMarkersArguments& arguments);

}  // namespace saccade
