#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>

#include "server/capture/frame.hpp"
#include "server/pipeline/commands.hpp"
#include "server/pipeline/team_port.hpp"
#include "server/team/merge/keyframe_maker.hpp"
#include "server/team/merge/map_joiner.hpp"

namespace saccade {

struct TeamRunnerOptions {
  std::string device_id;     // UUID
  std::string display_name;  // as others see it
  /// Keyframes are made from the first frame on; false: from when another server is first heard of.
  bool from_the_start = false;
  MapJoinerOptions joiner{.hold_ns = 250'000'000};  // threads are late, too, not only packets
};

/// This server's part in a team: makes keyframes of what the tracker publishes, tells them, finds
/// the others' maps in its own, and keeps copies of the others' marks, which are annotations like
/// any other here, by the device that they come from.
///
/// A thread of its own, at a low priority; the tracker's leaves the newest frame and goes on.
class TeamRunner final : public TeamPort {
 public:
  /// `commands` outlives it.
  TeamRunner(TeamRunnerOptions options, CommandPort& commands);
  ~TeamRunner() override;
  /// Before what `commands` leads to is gone. May be called twice.
  void Stop();

  /// After each frame, on the tracker's thread. Never blocks.
  void OnFrame(const std::shared_ptr<const Frame>& frame, const TrackedEvent& tracked);

  const std::string& device_id() const override { return options_.device_id; }
  void Hear(std::shared_ptr<const TeamNews> news) override;
  TeamState State() const override;
  std::shared_ptr<void> Listen(Listener listener) override;

 private:
  struct OwnFrame {
    std::shared_ptr<const Frame> frame;
    TrackedEvent tracked;
  };
  struct Heard {
    Timestamp arrived_ns = 0;
    std::shared_ptr<const TeamNews> news;
  };
  /// A mark of another's that is shown here.
  struct Copy {
    std::string id;                                       // here; empty: on its way
    Eigen::Vector3d asked_for = Eigen::Vector3d::Zero();  // [m, own world]
    std::uint64_t revision = 0;                           // of the original
  };
  struct Member {
    std::string display_name;
    Timestamp heard_ns = 0;
    std::optional<Timestamp> clock_ns;  // own clock - his
    std::optional<TeamPose> pose;
    std::unique_ptr<MapJoiner> joiner;
    AnnotationList marks;
    std::map<std::string, Copy> copies;  // by the original's id
    std::uint64_t synced_revision = 0;   // of the join
  };
  struct Ear {
    Listener listener;
    std::weak_ptr<void> alive;
    bool knows = false;  // all that was before
  };
  struct Made {
    std::string device_id, original, id;  // id empty: it could not be made
  };
  /// Answers of the tracker's thread; outlives this where they do.
  struct Answers {
    std::mutex mutex;
    std::vector<Made> made;
  };

  void Run(const std::stop_token& stop);
  void TakeAnswers();
  void TakeFrame(const OwnFrame& own);
  void TakeNews(const Heard& heard);
  Member& MemberOf(const Heard& heard);
  void TellMarks(const AnnotationList& all, TeamNews& news);
  void Tell(std::shared_ptr<TeamNews> news);
  std::shared_ptr<TeamNews> NewNews() const;
  void SyncMarks(const std::string& device_id, Member& member);
  void MakeCopy(const std::string& device_id, const Annotation& mark,
                const Similarity3& own_from_member, Copy& copy);
  void MoveCopy(const std::string& device_id, const Annotation& mark, Copy& copy);
  void Publish();

  const TeamRunnerOptions options_;
  CommandPort& commands_;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<OwnFrame> newest_;
  std::deque<Heard> heard_;
  std::vector<Ear> new_ears_;
  bool active_ = false;
  TeamState state_;

  const std::shared_ptr<Answers> answers_ = std::make_shared<Answers>();

  // The thread's.
  KeyframeMaker maker_;
  std::map<std::string, Member> members_;
  std::vector<Ear> ears_;
  AnnotationList told_marks_;
  Timestamp pose_told_ns_ = 0, marks_told_ns_ = 0;

  std::jthread thread_;
};

}  // namespace saccade
