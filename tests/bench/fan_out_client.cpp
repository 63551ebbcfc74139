#include "tests/bench/fan_out_client.hpp"

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <utility>

namespace saccade {
namespace {

constexpr std::uint64_t kAcknowledgeEvery = 8;

/// The first bytes of a message, field by field.
class Fields {
 public:
  explicit Fields(const grpc::ByteBuffer& buffer) {
    std::vector<grpc::Slice> slices;
    if (!buffer.Dump(&slices).ok()) return;
    for (const grpc::Slice& slice : slices) {
      for (std::size_t i = 0; i < slice.size() && bytes_.size() < 48; ++i) {
        bytes_.push_back(slice.begin()[i]);
      }
    }
  }
  std::uint64_t Varint() {
    std::uint64_t value = 0;
    for (int shift = 0; at_ < bytes_.size() && shift < 64; shift += 7) {
      const std::uint8_t byte = bytes_[at_++];
      value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
      if ((byte & 0x80) == 0) break;
    }
    return value;
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

constexpr std::uint64_t Tag(int field, int wire_type) {
  return static_cast<std::uint64_t>(field) << 3 | static_cast<std::uint64_t>(wire_type);
}

grpc::ChannelArguments OwnSocket() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt("grpc.http2.bdp_probe", 0);
  arguments.SetMaxReceiveMessageSize(-1);
  return arguments;
}

grpc::ByteBuffer Serialized(const google::protobuf::Message& message) {
  const grpc::Slice slice(message.SerializeAsString());
  return grpc::ByteBuffer(&slice, 1);
}

}  // namespace

// Every operation's tag is a function that is run, with its `ok`, when it is done.
class FanOutClients::Client {
 public:
  using Step = std::function<void(bool)>;

  Client(const std::string& address, grpc::CompletionQueue& queue)
      : channel_(
            grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), OwnSocket())),
        generic_(channel_),
        session_(v1::SessionService::NewStub(channel_)),
        queue_(queue) {
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    v1::JoinRequest request;
    request.set_display_name("bench");
    request.set_role(v1::ROLE_VIEWER);
    v1::JoinResponse response;
    const grpc::Status status = session_->Join(&context, request, &response);
    if (!status.ok()) {
      std::fprintf(stderr, "Join: %s\n", status.error_message().c_str());
      std::exit(1);
    }
    session_id_ = response.session_id();
  }

  void Start() {
    call_ = generic_.PrepareCall(&context_, "/saccade.v1.SessionService/Subscribe", &queue_);
    call_->StartCall(&started_);
  }
  void Cancel() { context_.TryCancel(); }

  FanOutCounts counts;

 private:
  void OnStarted(bool ok) {
    if (!ok) return End();
    v1::SubscribeRequest request;
    request.set_session_id(session_id_);
    call_->WriteLast(Serialized(request), grpc::WriteOptions(), &written_);
  }
  void OnRead(bool ok) {
    if (!ok) return End();
    Count();
    Acknowledge();
    event_.Clear();
    call_->Read(&event_, &read_);
  }
  void End() { counts.ended = true; }

  void Count() {
    ++counts.events;
    counts.bytes += event_.Length();
    Fields fields(event_);
    if (fields.Varint() != Tag(1, 0)) return;
    sequence_ = fields.Varint();
    const std::uint64_t kind = fields.Varint();
    if (kind == Tag(2, 2)) ++counts.poses;
    if (kind != Tag(4, 2)) return;
    fields.Varint();  // length
    const std::uint64_t frame = fields.Varint() == Tag(1, 0) ? fields.Varint() : 0;
    if (counts.has_frame && frame > counts.last_frame + 1) {
      counts.skipped += frame - counts.last_frame - 1;
    }
    counts.has_frame = true;
    counts.last_frame = frame;
    ++counts.pictures;
  }

  void Acknowledge() {
    if (acknowledging_ || sequence_ < acknowledged_ + kAcknowledgeEvery) return;
    acknowledging_ = true;
    acknowledged_ = sequence_;
    ack_context_ = std::make_unique<grpc::ClientContext>();
    v1::AcknowledgeRequest request;
    request.set_session_id(session_id_);
    request.set_sequence(sequence_);
    ack_ = session_->AsyncAcknowledge(ack_context_.get(), request, &queue_);
    ack_->Finish(&ack_response_, &ack_status_, &acknowledged_step_);
  }

  std::shared_ptr<grpc::Channel> channel_;
  grpc::GenericStub generic_;
  std::unique_ptr<v1::SessionService::Stub> session_;
  grpc::CompletionQueue& queue_;
  std::string session_id_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
  grpc::ByteBuffer event_;
  std::uint64_t sequence_ = 0, acknowledged_ = 0;
  bool acknowledging_ = false;
  std::unique_ptr<grpc::ClientContext> ack_context_;
  std::unique_ptr<grpc::ClientAsyncResponseReader<v1::AcknowledgeResponse>> ack_;
  v1::AcknowledgeResponse ack_response_;
  grpc::Status ack_status_;

  Step started_ = [this](bool ok) { OnStarted(ok); };
  Step written_ = [this](bool ok) { ok ? call_->Read(&event_, &read_) : End(); };
  Step read_ = [this](bool ok) { OnRead(ok); };
  Step acknowledged_step_ = [this](bool) { acknowledging_ = false; };
};

FanOutClients::FanOutClients(const std::string& address, int count) {
  for (int i = 0; i < count; ++i) clients_.push_back(std::make_unique<Client>(address, queue_));
  for (const auto& client : clients_) client->Start();
  thread_ = std::thread([this] { Run(); });
}

FanOutClients::~FanOutClients() {
  {
    const std::lock_guard lock(mutex_);
    leaving_ = true;  // from here on no step begins anything
  }
  for (const auto& client : clients_) client->Cancel();
  queue_.Shutdown();
  thread_.join();
}

void FanOutClients::Run() {
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
    const std::lock_guard lock(mutex_);
    (*static_cast<Client::Step*>(tag))(ok && !leaving_);
  }
}

void FanOutClients::Reset() {
  const std::lock_guard lock(mutex_);
  for (const auto& client : clients_) {
    const FanOutCounts before = client->counts;
    client->counts = {};
    client->counts.ended = before.ended;
  }
}

std::vector<FanOutCounts> FanOutClients::counts() const {
  const std::lock_guard lock(mutex_);
  std::vector<FanOutCounts> all;
  for (const auto& client : clients_) all.push_back(client->counts);
  return all;
}

}  // namespace saccade
