#include "server/rpc/stream_writer.hpp"

#include <array>

#include "server/rpc/status.hpp"

namespace saccade {
namespace {

// A slice that holds the bytes as long as gRPC needs them.
grpc::Slice Shared(const Bytes& bytes) {
  return {const_cast<char*>(bytes->data()), bytes->size(),
          [](void* held) { delete static_cast<Bytes*>(held); }, new Bytes(bytes)};
}

grpc::ByteBuffer ToBuffer(const EncodedEvent& event) {
  std::array<grpc::Slice, 3> slices;
  std::size_t count = 0;
  slices[count++] = grpc::Slice(event.head);
  if (event.shared && !event.shared->empty()) slices[count++] = Shared(event.shared);
  if (!event.tail.empty()) slices[count++] = grpc::Slice(event.tail);
  return {slices.data(), count};
}

}  // namespace

StreamWriter* StreamWriter::Open(StreamHub& hub, Session session,
                                 const SubscriptionOptions& options,
                                 grpc::CallbackServerContext& context, std::shared_ptr<void> hold) {
  auto* writer = new StreamWriter(hub, std::move(session), options, context, std::move(hold));
  writer->self_.reset(writer);
  hub.Add(writer->self_);
  return writer;
}

void StreamWriter::Pump() {
  bool write = false;
  bool ask = false;
  {
    const std::lock_guard lock(mutex_);
    if (writing_ || finished_ || closing_) return;
    const Timestamp now_ns = MonotonicNow();
    EncodedEvent event;
    write = writing_ = subscription_.Next(now_ns, event);
    if (write) event_ = ToBuffer(event);
    ask = subscription_.WantsKeyFrame(now_ns);
  }
  // Outside the lock: gRPC may run OnWriteDone before StartWrite returns. Nothing else touches
  // event_ or finishes the call while writing_ is set.
  if (write) StartWrite(&event_);
  if (ask) hub_.AskForKeyFrame(view());
}

void StreamWriter::Close(const absl::Status& status) {
  {
    const std::lock_guard lock(mutex_);
    if (finished_ || closing_) return;
    if (writing_) {
      closing_ = status;
      return;
    }
    finished_ = true;
  }
  Finish(ToGrpc(status));
}

void StreamWriter::Abandon(const absl::Status& status) {
  Close(status);
  {
    const std::lock_guard lock(mutex_);
    if (!writing_) return;
  }
  // A write that nobody reads never ends by itself. Not under mutex_: gRPC may call back from here.
  const std::lock_guard lock(context_mutex_);
  if (!done_) context_.TryCancel();
}

void StreamWriter::OnWriteDone(bool ok) {
  std::optional<absl::Status> finish;
  {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (finished_) return;
    if (closing_) {
      finish = closing_;
    } else if (!ok) {
      finish = absl::CancelledError("the client has gone");
    }
    finished_ = finish.has_value();
  }
  if (finish) {
    Finish(ToGrpc(*finish));
  } else {
    Pump();
  }
}

void StreamWriter::OnCancel() {
  hub_.Remove(this);
  Close(absl::CancelledError("the client has gone"));
}

void StreamWriter::OnDone() {
  {
    const std::lock_guard lock(context_mutex_);
    done_ = true;
  }
  hub_.Remove(this);
  Audit("SessionService/Subscribe/end", session_.participant_id, absl::OkStatus());
  // The hub may still hold a reference for the length of one Distribute.
  const std::shared_ptr<StreamWriter> last = std::move(self_);
}

}  // namespace saccade
