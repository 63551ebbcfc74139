#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "server/capture/camera_files/camera_draft.hpp"
#include "server/capture/yaml_reader.hpp"

namespace saccade {

/// What several forms have in common. Each keeps its error in `yaml`, and notes in `draft` where
/// things are said.

/// The first of `names` that `yaml` has; the first of all if it has none.
std::string FirstOf(const YamlReader& yaml, std::initializer_list<const char*> names);

/// Takes over a number. Ranges are the business of the plausibility check.
double TakeNumber(YamlReader& yaml, const std::string& key, const std::string& prefix,
                  absl::string_view field, CameraDraft& draft);
/// Notes that camera.yaml's `field` is said in `key`.
void Note(const YamlReader& yaml, const std::string& key, const std::string& spelt,
          absl::string_view field, CameraDraft& draft);

/// [width, height].
void TakeResolution(YamlReader& yaml, const std::string& key, const std::string& prefix,
                    CameraDraft& draft);
/// [fx, fy, cx, cy].
void TakeFocals(YamlReader& yaml, const std::string& key, const std::string& prefix,
                CameraDraft& draft);
/// The nine numbers of [fx 0 cx; 0 fy cy; 0 0 1].
void TakeMatrix(YamlReader& yaml, const std::string& key, const std::string& prefix,
                const std::vector<double>& k, CameraDraft& draft);

/// Coefficients by the lens's name in other programs: radtan, plumb_bob, equidistant, fov, none...
/// `named` is the field that names the lens, `listed` the one with the coefficients.
void TakeLens(YamlReader& yaml, const std::string& named, const std::string& name,
              const std::string& listed, const std::string& prefix,
              const std::vector<double>& coefficients, CameraDraft& draft);
/// OpenCV's list of 4, 5, 8, 12 or 14; more than five must be zero.
void TakeOpenCvLens(YamlReader& yaml, const std::string& listed, const std::string& prefix,
                    const std::vector<double>& coefficients, CameraDraft& draft);

}  // namespace saccade
