#include "tests/lint/include_rules.hpp"

#include <gtest/gtest.h>

#include <string>

namespace saccade::lint::include_rules_test {
namespace {

TEST(IncludeDirection, TheTreePointsOnlyAlongTheArrows) {
  const TreeReport report = CheckTree(SACCADE_SOURCE_DIR);
  // A check that reads nothing passes always: the first commit had more than this.
  EXPECT_GE(report.files, 20);
  EXPECT_GE(report.includes, 50);
  for (const Violation& violation : report.violations) {
    ADD_FAILURE() << violation.file << ":" << violation.line << ": " << violation.include << ": "
                  << violation.rule;
  }
}

struct Case {
  const char* file;
  const char* line;
  bool allowed;
};

class IncludeRule : public ::testing::TestWithParam<Case> {};

TEST_P(IncludeRule, IsEnforced) {
  const auto violations = CheckFile(GetParam().file, std::string("\n") + GetParam().line + "\n");
  EXPECT_EQ(violations.empty(), GetParam().allowed) << GetParam().file << ": " << GetParam().line;
  for (const Violation& violation : violations) EXPECT_EQ(violation.line, 2);
}

INSTANTIATE_TEST_SUITE_P(
    Arrows, IncludeRule,
    ::testing::Values(Case{"server/tracker/a.cpp", "#include \"server/filter/ekf.hpp\"", true},
                      Case{"server/filter/a.cpp", "#include \"server/tracker/tracker.hpp\"", false},
                      Case{"server/filter/a.cpp", "  #  include \"server/map/map.hpp\"", false},
                      Case{"server/app/a.cpp", "#include \"server/gateway/gateway.hpp\"", true},
                      Case{"server/filter/a.cpp", "#include \"shared/geometry/so3.hpp\"", true},
                      Case{"server/filter/a.cpp", "#include \"client/net/connection.hpp\"", false},
                      Case{"server/nowhere/a.cpp", "#include \"server/filter/ekf.hpp\"", false},
                      Case{"client/cli/a.cpp", "#include \"client/net/connection.hpp\"", true},
                      Case{"client/net/a.cpp", "#include \"client/cli/main.hpp\"", false},
                      Case{"client/net/a.cpp", "#include \"server/capture/frame.hpp\"", false},
                      Case{"shared/scene/a.hpp", "#include \"shared/geometry/rigid3.hpp\"", true},
                      Case{"shared/geometry/a.hpp", "#include \"shared/scene/annotation.hpp\"",
                           false},
                      Case{"shared/wire/a.hpp", "#include \"server/capture/frame.hpp\"", false},
                      Case{"server/filter/a.cpp", "#include \"ekf.hpp\"", false},
                      Case{"server/filter/a.cpp", "#include \"../map/map.hpp\"", false},
                      Case{"server/filter/a.cpp", "#include <server/map/map.hpp>", false},
                      Case{"server/filter/a.cpp", "#include \"absl/status/status.h\"", true},
                      Case{"server/filter/a.cpp", "#include \"tests/support/world.hpp\"", false}));

INSTANTIATE_TEST_SUITE_P(
    Examples, IncludeRule,
    ::testing::Values(Case{"examples/cpp/a.cpp", "#include \"client/net/connection.hpp\"", true},
                      Case{"examples/cpp/a.cpp", "#include \"shared/scene/annotation.hpp\"", true},
                      Case{"examples/cpp/a.cpp", "#include \"client/cli/json.hpp\"", false},
                      Case{"examples/cpp/a.cpp", "#include \"server/rpc/status.hpp\"", false}));

INSTANTIATE_TEST_SUITE_P(
    Narrow, IncludeRule,
    ::testing::Values(Case{"server/rpc/a.cpp", "#include \"server/tracker/tracker.hpp\"", false},
                      Case{"server/rpc/a.cpp", "#include \"server/filter/ekf.hpp\"", false},
                      Case{"server/rpc/a.cpp", "#include \"server/encode/packet.hpp\"", true},
                      Case{"server/gateway/a.cpp", "#include \"server/store/store.hpp\"", false},
                      Case{"server/gateway/a.cpp", "#include \"shared/scene/annotation.hpp\"",
                           true}));

INSTANTIATE_TEST_SUITE_P(
    Homes, IncludeRule,
    ::testing::Values(Case{"server/rpc/a.cpp", "#include \"saccade/v1/session.grpc.pb.h\"", true},
                      Case{"client/net/a.cpp", "#include \"saccade/v1/session.grpc.pb.h\"", true},
                      Case{"client/cli/a.cpp", "#include \"saccade/v1/session.grpc.pb.h\"", false},
                      Case{"server/gateway/a.cpp", "#include <saccade/v1/session.grpc.pb.h>",
                           false},
                      Case{"shared/wire/a.cpp", "#include \"saccade/v1/session.pb.h\"", true},
                      Case{"server/encode/a.cpp", "#include \"saccade/v1/video.pb.h\"", false},
                      Case{"server/wear/a.cpp", "#include \"saccade/v1/wearer.pb.h\"", true},
                      Case{"server/wear/a.cpp", "#include \"saccade/v1/map.grpc.pb.h\"", false},
                      Case{"server/gateway/a.cpp", "#include <boost/beast/http.hpp>", true},
                      Case{"server/mount/a.cpp", "#include <boost/asio.hpp>", true},
                      Case{"server/rpc/a.cpp", "#include <boost/beast/http.hpp>", false},
                      Case{"server/anchors/a.cpp", "#include <sqlite3.h>", false},
                      Case{"server/capture/a.cpp", "#include <opencv2/videoio.hpp>", false},
                      Case{"server/sim/a.cpp", "#include <GL/osmesa.h>", false},
                      Case{"server/filter/a.cpp", "#include <grpcpp/grpcpp.h>", false}));

INSTANTIATE_TEST_SUITE_P(
    Web, IncludeRule,
    ::testing::Values(Case{"web/src/scene/a.ts", "import * as THREE from 'three';", true},
                      Case{"web/src/session/a.ts", "import { Vector3 } from 'three';", false},
                      Case{"web/src/geometry/a.ts", "import { Vector3 } from \"three\";", false},
                      Case{"web/src/geometry/axes.ts", "import { Matrix4 } from 'three';", true},
                      Case{"web/src/ui/a.ts", "import { x } from '../session/state';", true},
                      Case{"web/src/ui/a.ts", "import x from '../../../server/app/x';", false}));

}  // namespace
}  // namespace saccade::lint::include_rules_test
