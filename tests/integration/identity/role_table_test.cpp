// Role by method: each cell over gRPC and over the gateway, both with TLS.
#include "server/identity/role_table.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/dynamic_message.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <set>

#include "saccade/v1/annotation.pb.h"
#include "saccade/v1/calibration.pb.h"
#include "saccade/v1/gaze.pb.h"
#include "saccade/v1/map.pb.h"
#include "saccade/v1/pointer.pb.h"
#include "saccade/v1/recording.pb.h"
#include "saccade/v1/replay.pb.h"
#include "saccade/v1/scene.pb.h"
#include "saccade/v1/session.pb.h"
#include "saccade/v1/team.pb.h"
#include "saccade/v1/wearer.pb.h"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/https_client.hpp"

namespace saccade::testing::role_table_test {
namespace {

using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;

constexpr int kUnauthenticated = 16, kPermissionDenied = 7;

enum Least { kAnyone, kViewer, kAnnotator, kPilot, kWearer, kOwner };

// What is promised to people, written down once more: the server's own table is what is tested.
const std::map<std::string, Least>& Promised() {
  static const std::map<std::string, Least> rows = {
      {"AccessService/GetAccess", kAnyone},
      {"AccessService/Redeem", kAnyone},
      {"AccessService/BeginSignIn", kAnyone},
      {"AccessService/FinishSignIn", kAnyone},
      {"AccessService/CreateInvite", kOwner},
      {"AccessService/ListInvites", kOwner},
      {"AccessService/ListAudit", kOwner},
      {"AccessService/RevokeInvite", kOwner},
      {"AccessService/ListWaiting", kWearer},
      {"AccessService/Admit", kWearer},
      {"SessionService/Join", kViewer},
      {"SessionService/Subscribe", kViewer},
      {"SessionService/Acknowledge", kViewer},
      {"SessionService/Ping", kViewer},
      {"SessionService/GetFrame", kViewer},
      {"SessionService/GetStatus", kViewer},
      {"SessionService/PausePicture", kWearer},
      {"SceneService/ListScene", kViewer},
      {"SceneService/GetModel", kViewer},
      {"SceneService/PutObject", kAnnotator},
      {"SceneService/RemoveObject", kAnnotator},
      {"SceneService/PlaceObject", kAnnotator},
      {"SceneService/UploadModel", kAnnotator},
      {"SceneService/RegisterObject", kAnnotator},
      {"TalkService/ListMessages", kViewer},
      {"TalkService/Say", kAnnotator},
      {"TalkService/Speak", kAnnotator},
      {"TeamService/GetTeam", kViewer},
      {"TeamService/Follow", kViewer},
      {"TeamService/Tell", kPilot},
      {"AnnotationService/List", kViewer},
      {"AnnotationService/Create", kAnnotator},
      {"AnnotationService/Update", kAnnotator},
      {"AnnotationService/Delete", kAnnotator},
      {"AnnotationService/Undo", kAnnotator},
      {"AnnotationService/Redo", kAnnotator},
      {"AnnotationService/TickCheckItem", kAnnotator},
      {"AnnotationService/GetPicture", kViewer},
      {"PointerService/Point", kAnnotator},
      {"CalibrationService/GetCalibration", kViewer},
      {"CalibrationService/GetCalibrationFile", kViewer},
      {"CalibrationService/StartCalibration", kPilot},
      {"CalibrationService/FinishCalibration", kPilot},
      {"CalibrationService/StopCalibration", kPilot},
      {"CalibrationService/SaveCalibration", kWearer},
      {"SurfaceService/Get", kViewer},
      {"RecordingService/GetRecording", kViewer},
      {"RecordingService/StartRecording", kWearer},
      {"RecordingService/StopRecording", kWearer},
      {"ReplayService/GetReplay", kViewer},
      {"ReplayService/ChangeReplay", kPilot},
      {"MapService/Get", kViewer},
      {"MapService/Export", kViewer},
      {"MapService/List", kViewer},
      {"MapService/Reset", kPilot},
      {"MapService/Save", kPilot},
      {"MapService/Load", kPilot},
      {"MapService/Delete", kPilot},
      {"MapService/ExportFile", kPilot},
      {"MapService/ImportFile", kPilot},
      {"GazeService/GetState", kViewer},
      {"GazeService/GetMountCalibration", kViewer},
      {"GazeService/AcquireLease", kPilot},
      {"GazeService/ReleaseLease", kPilot},
      {"GazeService/Fixate", kPilot},
      {"GazeService/StopFixating", kPilot},
      {"GazeService/Home", kPilot},
      {"GazeService/KeepHorizon", kPilot},
      {"GazeService/Explore", kPilot},
      {"GazeService/CalibrateMount", kPilot},
      {"GazeService/Override", kWearer},
      {"GazeService/Pause", kWearer}};
  return rows;
}

std::vector<const MethodDescriptor*> EveryMethod() {
  std::vector<const MethodDescriptor*> all;
  // Referred to, so that the linker keeps what stands in their files.
  for (const auto* linked :
       {v1::GetAccessRequest::descriptor(), v1::JoinRequest::descriptor(),
        v1::ListAnnotationsRequest::descriptor(), v1::GetMapRequest::descriptor(),
        v1::GetGazeStateRequest::descriptor(), v1::PointRequest::descriptor(),
        v1::WearerHello::descriptor(), v1::ListSceneRequest::descriptor(),
        v1::GetCalibrationRequest::descriptor(), v1::GetTeamRequest::descriptor(),
        v1::GetRecordingRequest::descriptor(), v1::GetReplayRequest::descriptor()}) {
    EXPECT_NE(linked, nullptr);
  }
  std::vector<const google::protobuf::FileDescriptor*> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(SACCADE_SOURCE_DIR "/proto/saccade/v1")) {
    const std::string name = "saccade/v1/" + entry.path().filename().string();
    files.push_back(google::protobuf::DescriptorPool::generated_pool()->FindFileByName(name));
    EXPECT_NE(files.back(), nullptr) << name << ": refer to one of its messages above";
    if (files.back() == nullptr) files.pop_back();
  }
  for (const auto* file : files) {
    for (int i = 0; i < file->service_count(); ++i) {
      const ServiceDescriptor* service = file->service(i);
      for (int j = 0; j < service->method_count(); ++j) all.push_back(service->method(j));
    }
  }
  return all;
}

std::string RowOf(const MethodDescriptor& method) {
  return method.service()->name() + "/" + method.name();
}

/// An empty request, in a session where it has one.
std::string RequestBytes(const MethodDescriptor& method, const std::string& session_id) {
  google::protobuf::DynamicMessageFactory factory;
  const std::unique_ptr<google::protobuf::Message> message(
      factory.GetPrototype(method.input_type())->New());
  if (const auto* field = method.input_type()->FindFieldByName("session_id"); field != nullptr) {
    message->GetReflection()->SetString(message.get(), field, session_id);
  }
  return message->SerializeAsString();
}

/// Refused for what one may, rather than for what was asked.
bool RefusedEntry(int code, const std::string& message, int with) {
  return code == with && message.rfind("access: ", 0) == 0;
}

class RoleTable : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new GuardedServer; }
  static void TearDownTestSuite() { delete server_; }

  struct Way {
    const char* name;
    std::function<Outcome(const MethodDescriptor&, const std::string& message,
                          const std::string& token)>
        call;
  };
  static std::vector<Way> Ways() {
    return {
        {"gRPC",
         [](const MethodDescriptor& method, const std::string& message, const std::string& token) {
           return server_->Call(method.service()->full_name() + "/" + method.name(), message,
                                token);
         }},
        {"gateway",
         [](const MethodDescriptor& method, const std::string& message, const std::string& token) {
           const HttpsReply reply =
               CallOverWeb(server_->http_port(), server_->root_pem(),
                           method.service()->full_name() + "/" + method.name(), message, token);
           EXPECT_EQ(reply.http_status, 200) << reply.head << reply.body;
           if (reply.grpc_status < 0 && reply.message) return Outcome{0, ""};
           return Outcome{reply.grpc_status, reply.grpc_message};
         }}};
  }
  static GuardedServer* server_;
};
GuardedServer* RoleTable::server_ = nullptr;

// A new RPC without a row fails here, before anybody can call it.
TEST_F(RoleTable, HasARowForEveryMethodThatExists) {
  std::set<std::string> existing;
  for (const MethodDescriptor* method : EveryMethod()) {
    const std::string row = RowOf(*method);
    existing.insert(row);
    EXPECT_TRUE(Promised().contains(row)) << row << ": say here who may call it";
    EXPECT_TRUE(LeastRole(row).has_value())
        << row << ": is not in server/identity/role_table.cpp, so nobody may call it";
  }
  for (const auto& [row, least] : Promised()) {
    EXPECT_TRUE(existing.contains(row)) << row << " does not exist (any more)";
  }
  for (const RoleRow& row : saccade::RoleTable()) {
    const std::string what(row.what);
    if (what.rfind("GET ", 0) == 0 || what.rfind("Health/", 0) == 0) continue;
    EXPECT_TRUE(existing.contains(what)) << what << " does not exist (any more)";
  }
}

TEST_F(RoleTable, EachRoleMayCallWhatItsRowSaysAndNothingElse) {
  struct Caller {
    const char* name;
    Least role;
    std::string token;
  };
  const std::vector<Caller> callers = {
      {"nobody", kAnyone, ""},
      {"viewer", kViewer, server_->PassOf(v1::ACCESS_ROLE_VIEWER)},
      {"annotator", kAnnotator, server_->PassOf(v1::ACCESS_ROLE_ANNOTATOR)},
      {"pilot", kPilot, server_->PassOf(v1::ACCESS_ROLE_PILOT)},
      {"wearer", kWearer, server_->PassOf(v1::ACCESS_ROLE_WEARER)},
      {"owner", kOwner, server_->owner_token()}};
  int cells = 0;
  for (const Way& way : Ways()) {
    for (const Caller& caller : callers) {
      const std::string session = caller.role == kAnyone ? "" : server_->Join(caller.token);
      for (const MethodDescriptor* method : EveryMethod()) {
        const std::string row = RowOf(*method);
        const auto [code, message] =
            way.call(*method, RequestBytes(*method, session), caller.token);
        const bool may = caller.role >= Promised().at(row);
        const int refusal = caller.role == kAnyone ? kUnauthenticated : kPermissionDenied;
        // A request without content is refused for that, but not for who sent it.
        const bool redeems_nothing = row == "AccessService/Redeem" && code == kUnauthenticated;
        const bool refused = RefusedEntry(code, message, refusal) && !redeems_nothing;
        EXPECT_EQ(refused, !may) << way.name << ", " << caller.name << ", " << row << ": " << code
                                 << " " << message;
        EXPECT_GE(code, 0) << way.name << ", " << caller.name << ", " << row << ": no answer";
        if (may) {
          EXPECT_FALSE(RefusedEntry(code, message, kPermissionDenied)) << row << message;
        }
        ++cells;
      }
    }
  }
  std::printf("%d cells: 2 ways x 6 callers x %zu methods\n", cells, EveryMethod().size());
  EXPECT_EQ(static_cast<std::size_t>(cells), 2 * 6 * Promised().size());
}

// Each refused in every method, over both ways.
TEST_F(RoleTable, NoTokenThatIsNotInForceOpensAnything) {
  std::string invite_id;
  const std::string revoked = server_->PassOf(v1::ACCESS_ROLE_WEARER, &invite_id);
  EXPECT_EQ(server_->Revoke(invite_id).code, 0);
  std::string forged = server_->PassOf(v1::ACCESS_ROLE_WEARER);
  forged.back() = forged.back() == 'A' ? 'B' : 'A';
  const std::string invite = server_->Invite(v1::ACCESS_ROLE_WEARER);
  const std::map<std::string, std::string> tokens = {{"revoked", revoked},
                                                     {"forged", forged},
                                                     {"an invite that was not redeemed", invite},
                                                     {"nonsense", "let me in"}};
  for (const Way& way : Ways()) {
    for (const auto& [name, token] : tokens) {
      for (const MethodDescriptor* method : EveryMethod()) {
        if (Promised().at(RowOf(*method)) == kAnyone) continue;
        const auto [code, message] = way.call(*method, RequestBytes(*method, ""), token);
        EXPECT_TRUE(RefusedEntry(code, message, kUnauthenticated))
            << way.name << ", " << name << ", " << RowOf(*method) << ": " << code << " " << message;
      }
    }
  }
}

TEST_F(RoleTable, ASessionBelongsToItsToken) {
  const std::string owner = server_->PassOf(v1::ACCESS_ROLE_WEARER);
  const std::string thief = server_->PassOf(v1::ACCESS_ROLE_WEARER);
  const std::string session = server_->Join(owner);
  constexpr int kNotFound = 5;
  int tried = 0;
  for (const Way& way : Ways()) {
    for (const MethodDescriptor* method : EveryMethod()) {
      if (method->input_type()->FindFieldByName("session_id") == nullptr) continue;
      const auto [code, message] = way.call(*method, RequestBytes(*method, session), thief);
      EXPECT_EQ(code, kNotFound) << way.name << ", " << RowOf(*method) << ": " << message;
      EXPECT_THAT(message, ::testing::HasSubstr("session_id: unknown"));
      ++tried;
    }
  }
  EXPECT_GT(tried, 20);
}

}  // namespace
}  // namespace saccade::testing::role_table_test
