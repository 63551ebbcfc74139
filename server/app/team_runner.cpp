#include "server/app/team_runner.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "server/app/team_marks.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxHeard = 256, kMaxMembers = 16;
constexpr Timestamp kPoseEvery_ns = 100'000'000, kMarksEvery_ns = 300'000'000;
constexpr Timestamp kLately_ns = 3'000'000'000;
constexpr Timestamp kDrift = 10'000;   // of clocks: a part in so many
constexpr double kMarkMoved_m = 0.02;  // slam-spec 9

double LargestSigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues()[2]));
}

}  // namespace

TeamRunner::TeamRunner(TeamRunnerOptions options, CommandPort& commands)
    : options_(std::move(options)), commands_(commands), active_(options_.from_the_start) {
  state_.device_id = options_.device_id;
  state_.display_name = options_.display_name;
  thread_ = std::jthread([this](const std::stop_token& stop) {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);  // what is live comes first
    Run(stop);
  });
}

TeamRunner::~TeamRunner() { Stop(); }

void TeamRunner::Stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
}

void TeamRunner::OnFrame(const std::shared_ptr<const Frame>& frame, const TrackedEvent& tracked) {
  {
    const std::lock_guard lock(mutex_);
    if (!active_) return;
    newest_ = OwnFrame{frame, tracked};
  }
  changed_.notify_all();
}

void TeamRunner::Hear(std::shared_ptr<const TeamNews> news) {
  {
    const std::lock_guard lock(mutex_);
    active_ = true;
    heard_.push_back({MonotonicNow(), std::move(news)});
    if (heard_.size() > kMaxHeard) heard_.pop_front();
  }
  changed_.notify_all();
}

TeamState TeamRunner::State() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::shared_ptr<void> TeamRunner::Listen(Listener listener) {
  auto alive = std::make_shared<int>();
  {
    const std::lock_guard lock(mutex_);
    active_ = true;
    new_ears_.push_back({std::move(listener), alive, false});
  }
  changed_.notify_all();
  return alive;
}

void TeamRunner::Run(const std::stop_token& stop) {
  while (true) {
    std::optional<OwnFrame> own;
    std::deque<Heard> heard;
    {
      std::unique_lock lock(mutex_);
      // A second: whoever is not heard of any more is noticed.
      changed_.wait_for(lock, stop, std::chrono::seconds(1),
                        [this] { return newest_ || !heard_.empty() || !new_ears_.empty(); });
      if (stop.stop_requested()) return;
      own = std::exchange(newest_, std::nullopt);
      heard.swap(heard_);
      std::move(new_ears_.begin(), new_ears_.end(), std::back_inserter(ears_));
      new_ears_.clear();
    }
    TakeAnswers();
    for (const Heard& each : heard) TakeNews(each);
    if (own) TakeFrame(*own);
    for (auto& [device_id, member] : members_) {
      if (member.joiner->Work() && member.joiner->join()) {
        const MapJoin& join = *member.joiner->join();
        if (join.revision == 1) {
          Log(absl::StrFormat("team: the map of %s is found in this one, by %d places",
                              member.display_name, join.places));
        }
      }
      SyncMarks(device_id, member);
    }
    Publish();
  }
}

void TeamRunner::TakeAnswers() {
  const std::lock_guard lock(answers_->mutex);
  for (const Made& one : answers_->made) {
    const auto member = members_.find(one.device_id);
    if (member == members_.end()) continue;
    if (one.id.empty()) {
      member->second.copies.erase(one.original);  // tried again with the next word of it
    } else {
      member->second.copies[one.original].id = one.id;
    }
  }
  answers_->made.clear();
}

std::shared_ptr<TeamNews> TeamRunner::NewNews() const {
  auto news = std::make_shared<TeamNews>();
  news->device_id = options_.device_id;
  news->display_name = options_.display_name;
  news->sent_time_ns = MonotonicNow();
  return news;
}

void TeamRunner::TakeFrame(const OwnFrame& own) {
  const MapSnapshot& snapshot = *own.tracked.snapshot;
  std::vector<TeamKeyframe> keyframes = maker_.Add(*own.frame, snapshot);
  auto news = NewNews();
  const Timestamp now_ns = news->sent_time_ns;
  for (TeamKeyframe& keyframe : keyframes) {
    keyframe.told_time_ns = now_ns;
    for (auto& [device_id, member] : members_) member.joiner->Take(MapSide::kOwn, keyframe);
    news->keyframes.push_back(std::move(keyframe));
  }
  if (now_ns - pose_told_ns_ >= kPoseEvery_ns) {
    pose_told_ns_ = now_ns;
    TeamPose& pose = news->pose.emplace();
    pose.pose = snapshot;
    pose.pose.features.clear();
    pose.pose.advice.clear();
    pose.camera = own.tracked.camera->intrinsics();
  }
  if (now_ns - marks_told_ns_ >= kMarksEvery_ns) TellMarks(*own.tracked.annotations, *news);
  Tell(std::move(news));
}

void TeamRunner::TellMarks(const AnnotationList& all, TeamNews& news) {
  AnnotationList own;
  for (const Annotation& mark : all) {
    if (members_.contains(mark.author_person_id) || !mark.anchor.place_known) continue;
    own.push_back(mark);
  }
  if (SameMarks(own, told_marks_)) return;
  marks_told_ns_ = MonotonicNow();
  told_marks_ = own;
  news.marks = std::move(own);
}

void TeamRunner::Tell(std::shared_ptr<TeamNews> news) {
  std::erase_if(ears_, [](const Ear& ear) { return ear.alive.expired(); });
  const bool empty = news->keyframes.empty() && !news->pose && !news->marks;
  std::shared_ptr<TeamNews> everything;
  for (Ear& ear : ears_) {
    if (ear.knows) {
      if (!empty) ear.listener(news);
      continue;
    }
    if (!everything) {
      everything = NewNews();
      everything->pose = news->pose;
      everything->marks = told_marks_;
      everything->keyframes = maker_.All();
      for (TeamKeyframe& keyframe : everything->keyframes) {
        keyframe.told_time_ns = everything->sent_time_ns;
      }
    }
    ear.listener(everything);
    ear.knows = true;
  }
}

TeamRunner::Member& TeamRunner::MemberOf(const Heard& heard) {
  const auto [at, fresh] = members_.try_emplace(heard.news->device_id);
  Member& member = at->second;
  member.display_name = heard.news->display_name;
  // The quickest way here is the clocks' difference, but for that way's own time; clocks drift.
  const Timestamp apart_ns = heard.arrived_ns - heard.news->sent_time_ns;
  const Timestamp at_most_ns =
      member.clock_ns.value_or(apart_ns) + (heard.arrived_ns - member.heard_ns) / kDrift;
  member.clock_ns = fresh ? apart_ns : std::min(apart_ns, at_most_ns);
  member.heard_ns = heard.arrived_ns;
  if (!fresh) return member;
  member.joiner = std::make_unique<MapJoiner>(options_.joiner);
  for (TeamKeyframe& keyframe : maker_.All()) {
    keyframe.told_time_ns = member.heard_ns;
    member.joiner->Take(MapSide::kOwn, std::move(keyframe));
  }
  return member;
}

void TeamRunner::TakeNews(const Heard& heard) {
  const TeamNews& news = *heard.news;
  if (!members_.contains(news.device_id) && members_.size() >= kMaxMembers) return;
  Member& member = MemberOf(heard);
  for (TeamKeyframe keyframe : news.keyframes) {
    keyframe.told_time_ns += *member.clock_ns;
    member.joiner->Take(MapSide::kOther, std::move(keyframe));
  }
  if (news.pose) member.pose = news.pose;
  if (!news.marks) return;
  member.marks = *news.marks;
  member.synced_revision = 0;
}

void TeamRunner::SyncMarks(const std::string& device_id, Member& member) {
  const auto& join = member.joiner->join();
  if (!join || join->revision == member.synced_revision) return;
  member.synced_revision = join->revision;
  std::map<std::string, Copy> gone = member.copies;
  for (const Annotation& mark : member.marks) {
    gone.erase(mark.id);
    const Eigen::Vector3d here = join->fit.own_from_other * mark.anchor.point_in_world;
    const auto [at, fresh] = member.copies.try_emplace(mark.id);
    Copy& copy = at->second;
    if (fresh) {
      MakeCopy(device_id, mark, join->fit.own_from_other, copy);
      if (copy.revision == 0) member.copies.erase(at);  // not taken now
      continue;
    }
    const bool changed = copy.revision != mark.revision + 1;
    if (copy.id.empty() || (!changed && (here - copy.asked_for).norm() < kMarkMoved_m)) continue;
    copy.asked_for = here;
    MoveCopy(device_id, mark, copy);
  }
  for (const auto& [original, copy] : gone) {
    if (copy.id.empty()) continue;
    DeleteAnnotation erase{Editor(device_id), copy.id, [](const absl::Status&) {}};
    if (commands_.Submit(std::move(erase)).ok()) member.copies.erase(original);
  }
}

void TeamRunner::MakeCopy(const std::string& device_id, const Annotation& mark,
                          const Similarity3& own_from_member, Copy& copy) {
  const std::optional<AnnotationDraft> draft = CopyOf(mark, own_from_member, device_id);
  if (!draft) return;
  CreateAnnotation create{Editor(device_id), *draft, {}};
  create.done = [answers = answers_, device_id,
                 original = mark.id](const absl::StatusOr<Annotation>& done) {
    const std::lock_guard lock(answers->mutex);
    answers->made.push_back({device_id, original, done.ok() ? done->id : ""});
  };
  if (!commands_.Submit(std::move(create)).ok()) return;
  copy.asked_for = own_from_member * mark.anchor.point_in_world;
  copy.revision = mark.revision + 1;
}

void TeamRunner::MoveCopy(const std::string& device_id, const Annotation& mark, Copy& copy) {
  UpdateAnnotation update{Editor(device_id), {}, [](const absl::StatusOr<Annotation>&) {}};
  update.patch.id = copy.id;
  update.patch.target = PointTarget{copy.asked_for};
  update.patch.text = mark.text;
  update.patch.color_rgba = mark.color_rgba;
  if (commands_.Submit(std::move(update)).ok()) copy.revision = mark.revision + 1;
}

void TeamRunner::Publish() {
  TeamState state{options_.device_id, options_.display_name, maker_.size(), {}};
  for (const auto& [device_id, member] : members_) {
    TeamMember& one = state.members.emplace_back();
    one.device_id = device_id;
    one.display_name = member.display_name;
    one.heard = MonotonicNow() - member.heard_ns < kLately_ns;
    one.pose = member.pose;
    one.keyframes = member.joiner->book(MapSide::kOther).views().size();
    const auto& join = member.joiner->join();
    if (!join) continue;
    one.merged = true;
    one.own_from_member = join->fit.own_from_other;
    one.sigma_m = LargestSigma(join->fit.covariance.topLeftCorner<3, 3>());
    one.sigma_rad = LargestSigma(join->fit.covariance.block<3, 3>(3, 3));
    one.revision = join->revision;
    one.places = join->places;
    if (!one.pose) continue;
    one.pose->pose.world_from_camera = one.own_from_member.Move(one.pose->pose.world_from_camera);
  }
  const std::lock_guard lock(mutex_);
  state_ = std::move(state);
}

}  // namespace saccade
