#include "tests/integration/attack/good_expert.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "client/net/connection.hpp"
#include "tests/integration/attack/calls.hpp"

namespace saccade::testing {
namespace {

constexpr auto kCallLimit = seconds(5);
constexpr auto kStreamLimit = seconds(5);

void SetDeadline(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + kCallLimit);
}

}  // namespace

GoodExpert::GoodExpert(Target& target) {
  const std::shared_ptr<grpc::Channel> channel = target.NewChannel();
  session_ = v1::SessionService::NewStub(channel);
  annotations_ = v1::AnnotationService::NewStub(channel);
  session_id_ = JoinSession(channel, v1::ROLE_EXPERT, seconds(20), "Good Expert");
  if (session_id_.empty()) {
    std::fprintf(stderr, "the good expert cannot join\n");
    std::abort();
  }
  v1::SubscribeRequest request;
  request.set_session_id(session_id_);
  reader_ = session_->Subscribe(&context_, request);
  read_ = std::thread([this] { Read(); });
  acknowledge_ = std::thread([this] { Acknowledge(); });
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, seconds(60), [this] { return received_.poses > 0 || ended_; });
}

GoodExpert::~GoodExpert() {
  {
    const std::lock_guard lock(mutex_);
    leaving_ = true;
  }
  changed_.notify_all();
  context_.TryCancel();
  if (work_.joinable()) work_.join();
  read_.join();
  acknowledge_.join();
}

void GoodExpert::Read() {
  v1::Event event;
  while (reader_->Read(&event)) Take(event);
  const grpc::Status end = reader_->Finish();
  const std::lock_guard lock(mutex_);
  ended_ = true;
  if (!leaving_) complaints_.push_back("the stream ended: " + end.error_message());
  changed_.notify_all();
}

void GoodExpert::Take(const v1::Event& event) {
  const std::lock_guard lock(mutex_);
  if (event.sequence() != sequence_ + 1) {
    complaints_.push_back("event " + std::to_string(event.sequence()) + " came after " +
                          std::to_string(sequence_));
  }
  sequence_ = event.sequence();
  received_.bytes += static_cast<long>(event.ByteSizeLong());
  if (event.has_pose()) ++received_.poses;
  if (event.has_access_unit()) ++received_.pictures;
  if (event.has_presence()) {
    received_.participants = static_cast<std::size_t>(event.presence().participants_size());
  }
  if (event.has_statistics()) {
    const v1::StatisticsEvent& figures = event.statistics();
    received_.encoded_fps_max_hz = std::max(received_.encoded_fps_max_hz, figures.encoded_fps_hz());
    received_.bad_frames = figures.bad_frames();
    received_.events_skipped = figures.events_skipped();
  }
  for (const v1::Annotation& one : event.annotation().upserted()) {
    if (one.text().rfind("mark ", 0) != 0) continue;  // strangers' make millions
    seen_.insert(one.id() + " " + one.text());
  }
  for (const std::string& id : event.annotation().removed_ids()) {
    if (std::find(marks_.begin(), marks_.end(), id) != marks_.end()) seen_.insert("-" + id);
  }
  changed_.notify_all();
}

// Always the newest: what comes while a call is under way is acknowledged with the next one.
void GoodExpert::Acknowledge() {
  std::uint64_t acknowledged = 0;
  while (true) {
    v1::AcknowledgeRequest request;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return leaving_ || ended_ || sequence_ > acknowledged; });
      if (leaving_ || ended_) return;
      acknowledged = sequence_;
    }
    request.set_session_id(session_id_);
    request.set_sequence(acknowledged);
    grpc::ClientContext context;
    SetDeadline(context);
    v1::AcknowledgeResponse response;
    const grpc::Status status = session_->Acknowledge(&context, request, &response);
    if (!status.ok()) Complain("Acknowledge: " + status.error_message());
  }
}

void GoodExpert::Complain(const std::string& what) {
  const std::lock_guard lock(mutex_);
  if (!leaving_) complaints_.push_back(what);
}

void GoodExpert::PlaceMarks(int count, milliseconds pause) {
  work_ = std::thread([this, count, pause] {
    for (int i = 0; i < count; ++i) {
      if (!PlaceOne(i)) return;
      std::unique_lock lock(mutex_);
      if (changed_.wait_for(lock, pause, [this] { return leaving_ || ended_; })) return;
    }
  });
}

bool GoodExpert::PlaceOne(int number) {
  const std::string name = "mark " + std::to_string(number);
  const bool doomed = number % 3 == 2;
  std::string id;
  for (int turn = doomed ? 0 : 1; turn < 2; ++turn) {
    v1::CreateAnnotationRequest request;
    request.set_session_id(session_id_);
    request.set_request_id(net::RandomUuid());
    v1::AnnotationDraft& draft = *request.mutable_draft();
    draft.set_shape(v1::ANNOTATION_SHAPE_NOTE);
    draft.set_text(name);
    draft.mutable_target()->mutable_point_in_world_m()->set_x(0.02 * number);
    grpc::ClientContext context;
    SetDeadline(context);
    v1::CreateAnnotationResponse response;
    const grpc::Status status = annotations_->Create(&context, request, &response);
    if (!status.ok()) return Complain("Create " + name + ": " + status.error_message()), false;
    id = response.annotation().id();
    {
      const std::lock_guard lock(mutex_);
      marks_.push_back(id);
    }
    if (!AwaitOnStream(id + " " + name)) return false;
    if (turn == 1) break;
    grpc::ClientContext delete_context;
    SetDeadline(delete_context);
    v1::DeleteAnnotationRequest doom;
    doom.set_session_id(session_id_);
    doom.set_id(id);
    v1::DeleteAnnotationResponse gone;
    const grpc::Status deleted = annotations_->Delete(&delete_context, doom, &gone);
    if (!deleted.ok()) return Complain("Delete " + name + ": " + deleted.error_message()), false;
    if (!AwaitOnStream("-" + id)) return false;
    const std::lock_guard lock(mutex_);
    std::erase(marks_, id);
  }
  v1::UpdateAnnotationRequest update;
  update.set_session_id(session_id_);
  update.set_id(id);
  update.set_text(name + " changed");
  grpc::ClientContext context;
  SetDeadline(context);
  v1::UpdateAnnotationResponse response;
  const grpc::Status status = annotations_->Update(&context, update, &response);
  if (!status.ok()) return Complain("Update " + name + ": " + status.error_message()), false;
  return AwaitOnStream(id + " " + name + " changed");
}

bool GoodExpert::AwaitOnStream(const std::string& what) {
  std::unique_lock lock(mutex_);
  const bool came = changed_.wait_for(lock, kStreamLimit,
                                      [&] { return seen_.contains(what) || leaving_ || ended_; });
  if (!came) complaints_.push_back("answered OK, never on the stream: " + what);
  return came && seen_.contains(what);
}

// Every page of List.
std::vector<std::string> GoodExpert::ListedIds() {
  std::vector<std::string> ids;
  v1::ListAnnotationsRequest request;
  // The flood before has used up what this address may ask: a good client does as it is told.
  int patience = 50;
  for (int page = 0; page < 10'000; ++page) {
    grpc::ClientContext context;
    SetDeadline(context);
    v1::ListAnnotationsResponse response;
    const grpc::Status status = annotations_->List(&context, request, &response);
    if (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED && --patience > 0) {
      std::this_thread::sleep_for(milliseconds(100));
      continue;
    }
    if (!status.ok()) {
      Complain("List: " + status.error_message());
      break;
    }
    for (const v1::Annotation& one : response.annotations()) ids.push_back(one.id());
    if (response.next_page_token().empty()) break;
    request.set_page_token(response.next_page_token());
  }
  return ids;
}

std::string GoodExpert::Verdict() {
  if (work_.joinable()) work_.join();
  const std::vector<std::string> listed = ListedIds();
  const std::lock_guard lock(mutex_);
  std::string verdict;
  for (const std::string& id : marks_) {
    if (std::find(listed.begin(), listed.end(), id) == listed.end()) {
      verdict += "mark " + id + " was answered and is not listed\n";
    }
  }
  for (std::size_t i = 0; i < complaints_.size() && i < 10; ++i) verdict += complaints_[i] + "\n";
  return verdict;
}

std::size_t GoodExpert::marks() const {
  const std::lock_guard lock(mutex_);
  return marks_.size();
}

Received GoodExpert::received() const {
  const std::lock_guard lock(mutex_);
  return received_;
}

void GoodExpert::ForgetMaximum() {
  const std::lock_guard lock(mutex_);
  received_.encoded_fps_max_hz = 0;
}

double GoodExpert::PoseRate(milliseconds span) const {
  const auto from = Clock::now();
  const long before = received().poses;
  std::this_thread::sleep_for(span);
  const std::chrono::duration<double> elapsed = Clock::now() - from;
  return static_cast<double>(received().poses - before) / elapsed.count();
}

double GoodExpert::ByteRate(milliseconds span) const {
  const auto from = Clock::now();
  const long before = received().bytes;
  std::this_thread::sleep_for(span);
  const std::chrono::duration<double> elapsed = Clock::now() - from;
  return static_cast<double>(received().bytes - before) / elapsed.count();
}

bool GoodExpert::WaitForParticipants(std::size_t count, milliseconds limit) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, limit, [&] { return received_.participants == count; });
}

}  // namespace saccade::testing
