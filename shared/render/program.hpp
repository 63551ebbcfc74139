#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>

#include "shared/render/gl_functions.hpp"

namespace saccade {

/// A linked vertex and fragment shader. Created, used and destroyed while its context is current;
/// `gl` must outlive it.
class Program {
 public:
  /// Compiles and links. `attributes[i]` gets location i. InvalidArgument carries the compiler's
  /// log.
  static absl::StatusOr<std::unique_ptr<Program>> Create(const GlFunctions& gl,
                                                         const std::string& vertex_source,
                                                         const std::string& fragment_source,
                                                         std::span<const char* const> attributes);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void Use() const;
  /// Setters act on the program in use; a name that the shader does not have is ignored, as in GL.
  void Set(const std::string& name, int value);
  void Set(const std::string& name, float value);
  void Set(const std::string& name, const Eigen::Vector2f& value);
  void Set(const std::string& name, const Eigen::Vector3f& value);
  void Set(const std::string& name, const Eigen::Vector4f& value);
  void Set(const std::string& name, const Eigen::Matrix4f& value);

 private:
  Program(const GlFunctions& gl, GLuint id) : gl_(gl), id_(id) {}
  GLint Location(const std::string& name);

  const GlFunctions& gl_;
  GLuint id_ = 0;
  std::unordered_map<std::string, GLint> locations_;
};

}  // namespace saccade
