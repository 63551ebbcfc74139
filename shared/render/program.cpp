#include "shared/render/program.hpp"

#include <absl/strings/str_cat.h>

#include <array>

namespace saccade {
namespace {

absl::StatusOr<GLuint> Compile(const GlFunctions& gl, GLenum kind, const std::string& source) {
  const GLuint shader = gl.CreateShader(kind);
  const char* text = source.c_str();
  gl.ShaderSource(shader, 1, &text, nullptr);
  gl.CompileShader(shader);
  GLint ok = GL_FALSE;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == GL_TRUE) return shader;
  std::array<char, 2048> log{};
  gl.GetShaderInfoLog(shader, log.size(), nullptr, log.data());
  gl.DeleteShader(shader);
  return absl::InvalidArgumentError(
      absl::StrCat(kind == GL_VERTEX_SHADER ? "vertex" : "fragment", " shader: ", log.data()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Program>> Program::Create(const GlFunctions& gl,
                                                         const std::string& vertex_source,
                                                         const std::string& fragment_source,
                                                         std::span<const char* const> attributes) {
  const absl::StatusOr<GLuint> vertex = Compile(gl, GL_VERTEX_SHADER, vertex_source);
  if (!vertex.ok()) return vertex.status();
  const absl::StatusOr<GLuint> fragment = Compile(gl, GL_FRAGMENT_SHADER, fragment_source);
  if (!fragment.ok()) {
    gl.DeleteShader(*vertex);
    return fragment.status();
  }
  const GLuint id = gl.CreateProgram();
  gl.AttachShader(id, *vertex);
  gl.AttachShader(id, *fragment);
  for (GLuint i = 0; i < attributes.size(); ++i) gl.BindAttribLocation(id, i, attributes[i]);
  gl.LinkProgram(id);
  gl.DeleteShader(*vertex);
  gl.DeleteShader(*fragment);
  GLint ok = GL_FALSE;
  gl.GetProgramiv(id, GL_LINK_STATUS, &ok);
  if (ok == GL_TRUE) return std::unique_ptr<Program>(new Program(gl, id));
  std::array<char, 2048> log{};
  gl.GetProgramInfoLog(id, log.size(), nullptr, log.data());
  gl.DeleteProgram(id);
  return absl::InvalidArgumentError(absl::StrCat("shader program: ", log.data()));
}

Program::~Program() { gl_.DeleteProgram(id_); }

void Program::Use() const { gl_.UseProgram(id_); }

GLint Program::Location(const std::string& name) {
  const auto [entry, added] = locations_.try_emplace(name, -1);
  if (added) entry->second = gl_.GetUniformLocation(id_, name.c_str());
  return entry->second;
}

void Program::Set(const std::string& name, int value) { gl_.Uniform1i(Location(name), value); }
void Program::Set(const std::string& name, float value) { gl_.Uniform1f(Location(name), value); }
void Program::Set(const std::string& name, const Eigen::Vector2f& value) {
  gl_.Uniform2f(Location(name), value.x(), value.y());
}
void Program::Set(const std::string& name, const Eigen::Vector3f& value) {
  gl_.Uniform3f(Location(name), value.x(), value.y(), value.z());
}
void Program::Set(const std::string& name, const Eigen::Vector4f& value) {
  gl_.Uniform4f(Location(name), value.x(), value.y(), value.z(), value.w());
}
void Program::Set(const std::string& name, const Eigen::Matrix4f& value) {
  gl_.UniformMatrix4fv(Location(name), 1, GL_FALSE, value.data());
}

}  // namespace saccade
