#include "server/gl/gl_context.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>

#include "shared/render/gl_functions.hpp"

namespace saccade::gl_context_test {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<GlFunctions> LoadFrom(const GlContext& context) {
  return GlFunctions::Load([&](const char* name) { return context.GetProcAddress(name); });
}

TEST(GlContext, BackendNamesAreParsedAndOthersRefusedByName) {
  EXPECT_EQ(*ParseGlBackend("osmesa"), GlBackend::kOsmesa);
  EXPECT_EQ(*ParseGlBackend("egl"), GlBackend::kEgl);
  const absl::Status refused = ParseGlBackend("vulkan").status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("vulkan"));
}

TEST(GlContext, EglSaysThatItIsNotPartOfThisBuild) {
  const absl::Status status = GlContext::Create(GlBackend::kEgl).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--gl osmesa"));
}

TEST(GlContext, OsmesaGivesEveryFunctionOfACoreContext) {
  const absl::StatusOr<std::unique_ptr<GlContext>> context = GlContext::Create();
  ASSERT_TRUE(context.ok()) << context.status();
  const absl::StatusOr<GlFunctions> gl = LoadFrom(**context);
  ASSERT_TRUE(gl.ok()) << gl.status();
  const std::string version(reinterpret_cast<const char*>(gl->GetString(GL_VERSION)));
  EXPECT_GE(std::stod(version), 3.3) << version;
}

TEST(GlContext, EachThreadMayHaveItsOwn) {
  const auto colors = [](float red, bool* same) {
    const absl::StatusOr<std::unique_ptr<GlContext>> context = GlContext::Create();
    ASSERT_TRUE(context.ok());
    const absl::StatusOr<GlFunctions> gl = LoadFrom(**context);
    ASSERT_TRUE(gl.ok());
    for (int k = 0; k < 50; ++k) {
      gl->ClearColor(red, 0, 0, 1);
      gl->Clear(GL_COLOR_BUFFER_BIT);
      unsigned char pixel[4] = {};
      gl->ReadPixels(3, 3, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel);
      if (pixel[0] != static_cast<unsigned char>(red * 255 + 0.5f)) return;
    }
    *same = true;
  };
  bool dark = false, bright = false;
  { const std::jthread a(colors, 0.2f, &dark), b(colors, 1.0f, &bright); }
  EXPECT_TRUE(dark);
  EXPECT_TRUE(bright);
}

}  // namespace
}  // namespace saccade::gl_context_test
