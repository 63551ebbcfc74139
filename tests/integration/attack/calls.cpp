#include "tests/integration/attack/calls.hpp"

#include <algorithm>
#include <thread>

#include "saccade/v1/session.pb.h"

namespace saccade::testing {
namespace {

grpc::ByteBuffer ToBuffer(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

std::string ToString(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string out;
  if (!buffer.Valid() || !buffer.Dump(&slices).ok()) return out;
  for (const grpc::Slice& slice : slices) {
    out.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return out;
}

}  // namespace

bool RawReply::RefusedWithRetry() const {
  return Is(grpc::StatusCode::RESOURCE_EXHAUSTED) &&
         status.error_details().find("google.rpc.RetryInfo") != std::string::npos;
}

RawReply Call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
              const std::string& request, milliseconds deadline) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + deadline);
  grpc::CompletionQueue queue;
  const grpc::ByteBuffer bytes = ToBuffer(request);
  grpc::ByteBuffer response;
  RawReply reply;
  const auto call = stub.PrepareUnaryCall(&context, method, bytes, &queue);
  call->StartCall();
  call->Finish(&response, &reply.status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  reply.bytes = ToString(response);
  return reply;
}

std::string JoinSession(const std::shared_ptr<grpc::Channel>& channel, int role,
                        milliseconds patience, const std::string& name) {
  v1::JoinRequest request;
  request.set_display_name(name);
  request.set_role(static_cast<v1::Role>(role));
  for (const auto end = Clock::now() + patience;;) {
    v1::JoinResponse response;
    const RawReply reply = Ask(channel, "SessionService/Join", request, response);
    if (reply.status.ok()) return response.session_id();
    if (!reply.Is(grpc::StatusCode::RESOURCE_EXHAUSTED) || Clock::now() >= end) return "";
    std::this_thread::sleep_for(milliseconds(200));
  }
}

void HeldStreams::Open(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                       const std::string& request) {
  Held& held = held_.emplace_back();
  held.request = ToBuffer(request);
  grpc::GenericStub stub(channel);
  held.call = stub.PrepareCall(&held.context, method, &queue_);
  held.call->StartCall(&held.started);
  held.call->Finish(&held.status, &held.finished);
  waiting_ += 2;
}

bool HeldStreams::TakeOne(milliseconds wait) {
  void* raw = nullptr;
  bool ok = false;
  const auto got = queue_.AsyncNext(&raw, &ok, std::chrono::system_clock::now() + wait);
  if (got != grpc::CompletionQueue::GOT_EVENT) return false;
  --waiting_;
  const Tag& tag = *static_cast<Tag*>(raw);
  if (tag.step == Step::kStarted && ok) {
    tag.held->call->Write(tag.held->request, &tag.held->written);
    ++waiting_;
  }
  if (tag.step == Step::kFinished) tag.held->over = true;
  return true;
}

int HeldStreams::open(milliseconds wait) {
  for (const auto end = Clock::now() + wait; Clock::now() < end;) TakeOne(milliseconds(10));
  return static_cast<int>(
      std::count_if(held_.begin(), held_.end(), [](const Held& held) { return !held.over; }));
}

void HeldStreams::Cancel() {
  if (std::exchange(cancelled_, true)) return;
  for (Held& held : held_) held.context.TryCancel();
  for (const auto end = Clock::now() + seconds(10); waiting_ > 0 && Clock::now() < end;) {
    TakeOne(milliseconds(100));
  }
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

void Tally::Add(const std::string& what, long count) {
  const std::lock_guard lock(mutex_);
  counts_[what] += count;
}

void Tally::Add(const grpc::Status& status) {
  static const std::map<int, std::string> kNames = {{0, "OK"},
                                                    {1, "CANCELLED"},
                                                    {2, "UNKNOWN"},
                                                    {3, "INVALID"},
                                                    {4, "DEADLINE_EXCEEDED"},
                                                    {5, "NOT_FOUND"},
                                                    {7, "PERMISSION"},
                                                    {8, "RESOURCE_EXHAUSTED"},
                                                    {9, "FAILED_PRECONDITION"},
                                                    {12, "UNIMPLEMENTED"},
                                                    {13, "INTERNAL"},
                                                    {14, "UNAVAILABLE"}};
  const auto name = kNames.find(status.error_code());
  Add(name == kNames.end() ? "code " + std::to_string(status.error_code()) : name->second);
}

long Tally::of(const std::string& what) const {
  const std::lock_guard lock(mutex_);
  const auto at = counts_.find(what);
  return at == counts_.end() ? 0 : at->second;
}

std::string Tally::ToString() const {
  const std::lock_guard lock(mutex_);
  std::string out;
  for (const auto& [what, count] : counts_) {
    out += (out.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  }
  return out.empty() ? "nothing" : out;
}

}  // namespace saccade::testing
