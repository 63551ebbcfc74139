#include "server/identity/role_table.hpp"

#include <array>

namespace saccade {
namespace {

using enum AccessRole;

constexpr auto kTable = std::to_array<RoleRow>({
    {"AccessService/GetAccess", kAnyone},  // says whether one needs a token
    {"AccessService/Redeem", kAnyone},     // an invite is its own admission
    {"AccessService/BeginSignIn", kAnyone},
    {"AccessService/FinishSignIn", kAnyone},
    {"AccessService/CreateInvite", kOwner},
    {"AccessService/ListInvites", kOwner},
    {"AccessService/RevokeInvite", kOwner},
    {"AccessService/ListAudit", kOwner},
    {"AccessService/ListWaiting", kWearer},  // whose eyes and ears it is
    {"AccessService/Admit", kWearer},

    {"SessionService/Join", kViewer},
    {"SessionService/Subscribe", kViewer},
    {"SessionService/Acknowledge", kViewer},
    {"SessionService/Ping", kViewer},
    {"SessionService/GetFrame", kViewer},
    {"SessionService/GetStatus", kViewer},
    {"SessionService/PausePicture", kWearer},

    {"AnnotationService/List", kViewer},
    {"AnnotationService/GetPicture", kViewer},
    {"AnnotationService/Create", kAnnotator},
    {"AnnotationService/Update", kAnnotator},
    {"AnnotationService/Delete", kAnnotator},
    {"AnnotationService/Undo", kAnnotator},
    {"AnnotationService/Redo", kAnnotator},
    {"AnnotationService/TickCheckItem", kAnnotator},

    {"PointerService/Point", kAnnotator},

    {"SceneService/ListScene", kViewer},
    {"SceneService/GetModel", kViewer},
    {"SceneService/PutObject", kAnnotator},
    {"SceneService/RemoveObject", kAnnotator},
    {"SceneService/PlaceObject", kAnnotator},
    {"SceneService/UploadModel", kAnnotator},
    {"SceneService/RegisterObject", kAnnotator},

    {"SurfaceService/Get", kViewer},

    {"CalibrationService/GetCalibration", kViewer},
    {"CalibrationService/GetCalibrationFile", kViewer},
    {"CalibrationService/StartCalibration", kPilot},
    {"CalibrationService/FinishCalibration", kPilot},
    {"CalibrationService/StopCalibration", kPilot},
    {"CalibrationService/SaveCalibration", kWearer},  // whose camera it is

    {"TalkService/ListMessages", kViewer},
    {"TalkService/Say", kAnnotator},
    {"TalkService/Speak", kAnnotator},

    {"TeamService/GetTeam", kViewer},
    {"TeamService/Follow", kViewer},
    {"TeamService/Tell", kPilot},  // another wearer's server: its marks come in

    {"RecordingService/GetRecording", kViewer},
    {"RecordingService/StartRecording", kWearer},  // whose eyes it is
    {"RecordingService/StopRecording", kWearer},

    {"ReplayService/GetReplay", kViewer},
    {"ReplayService/ChangeReplay", kPilot},  // for all who watch

    {"MapService/Get", kViewer},
    {"MapService/Export", kViewer},
    {"MapService/List", kViewer},
    {"MapService/Reset", kPilot},  // everybody's marks lose their place
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
    {"GazeService/Pause", kWearer},

    {"Health/Check", kAnyone},  // load balancers have no token
    {"Health/Watch", kViewer},

    // The gateway. The page's files hold nothing of the wearable; what it shows comes by the calls
    // above.
    {"GET /", kAnyone},
    {"GET /trust", kAnyone},
    {"GET /wear/upstream", kWearer},  // the phone that is the camera
});

}  // namespace

absl::Span<const RoleRow> RoleTable() { return kTable; }

std::optional<AccessRole> LeastRole(absl::string_view what) {
  for (const RoleRow& row : kTable) {
    if (row.what == what) return row.least;
  }
  return std::nullopt;
}

}  // namespace saccade
