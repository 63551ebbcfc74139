#include "server/wear/wearer_entrance.hpp"

#include <absl/strings/str_cat.h>

#include <atomic>
#include <utility>

#include "saccade/v1/wearer.pb.h"
#include "server/identity/role_table.hpp"
#include "server/pipeline/peer_address.hpp"
#include "shared/io/log.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMostHello = 4096, kMostMessage = (1 << 20) + 256;
constexpr std::size_t kMostId = 64, kMostLabel = 200;
constexpr int kMostMessages_hz = 400;        // 60 pictures and 120 samples of motion are usual
constexpr int kMostBytes_per_s = 6'000'000;  // a phone sends a twentieth of it
constexpr Timestamp kHelloTakes_ns = 3'000'000'000;
constexpr std::size_t kMostStrangers = 128, kMostStrangersOfPeer = 4;

PacketHeader::Codec CodecOf(v1::WearerCodec codec) {
  return codec == v1::WEARER_CODEC_VP8 ? PacketHeader::kVp8 : PacketHeader::kH264;
}

Eigen::Vector3d ToVector(const v1::Vector3& value) { return {value.x(), value.y(), value.z()}; }

}  // namespace

/// What the phone's side and the source's side of a link share.
class WearerEntrance::PhoneLinkImpl final : public PhoneLink {
 public:
  PhoneLinkImpl(std::string peer, std::shared_ptr<Out> out)
      : peer_(std::move(peer)), out_(std::move(out)) {}

  void Send(const v1::WearerDownstream& message) { out_->Send(message.SerializeAsString()); }
  void Refuse(const std::string& reason, bool final) {
    if (ended_.exchange(true)) return;
    Log(absl::StrCat("phone ", peer_, ": refused: ", Printable(reason)));
    v1::WearerDownstream message;
    message.mutable_refused()->set_reason(reason);
    message.mutable_refused()->set_final(final);
    Send(message);
    out_->End(reason.substr(0, 120));
  }
  bool ended() const { return ended_; }

  void WantKeyFrame() override {
    v1::WearerDownstream message;
    message.mutable_key_frame_wanted();
    Send(message);
  }
  void Problem(const std::string& text) override {
    v1::WearerDownstream message;
    message.mutable_problem()->set_text(text);
    Send(message);
  }

  /// Whose it is: the pass, and the phone's own id.
  std::string access_id, phone_id;
  const std::string& peer() const { return peer_; }

 private:
  const std::string peer_;
  const std::shared_ptr<Out> out_;
  std::atomic<bool> ended_ = false;
};

namespace {

/// Messages and bytes of this second.
class Rate {
 public:
  bool TooMuch(Timestamp now_ns, std::size_t bytes) {
    if (now_ns - begin_ns_ > 1'000'000'000) {
      begin_ns_ = now_ns;
      count_ = 0;
      bytes_ = 0;
    }
    bytes_ += bytes;
    return ++count_ > kMostMessages_hz || bytes_ > kMostBytes_per_s;
  }

 private:
  Timestamp begin_ns_ = 0;
  int count_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace

/// The socket's side: one thread.
class WearerEntrance::Conversation final : public WearerPort::Link {
 public:
  Conversation(WearerEntrance& entrance, const std::string& peer, std::shared_ptr<Out> out)
      : entrance_(entrance),
        link_(std::make_shared<PhoneLinkImpl>(peer, std::move(out))),
        stranger_(entrance.Arrive(peer)),
        crowded_(!stranger_) {}
  ~Conversation() override {
    if (let_in_) entrance_.Leave(link_.get());
    if (stranger_) entrance_.Depart(link_->peer());
  }

  std::size_t most_bytes() const override { return let_in_ ? kMostMessage : kMostHello; }

  void OnMessage(absl::string_view bytes) override {
    if (link_->ended() || crowded_) return;
    v1::WearerUpstream message;
    const Timestamp now_ns = MonotonicNow();
    if (rate_.TooMuch(now_ns, bytes.size())) {
      return link_->Refuse("too many messages: at most 400 and 6 MB a second are taken", false);
    }
    if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
      return link_->Refuse("a message is none of saccade.v1.WearerUpstream; load /wear anew", true);
    }
    if (message.has_hello() == let_in_) {
      return link_->Refuse("a link begins with one hello; load /wear anew", true);
    }
    if (message.has_hello()) return OnHello(message.hello());
    if (message.has_picture()) return OnPicture(*message.mutable_picture(), now_ns);
    if (message.has_ping()) return OnPing(message.ping(), now_ns);
    if (message.has_motion()) {
      const v1::WearerMotion& motion = message.motion();
      entrance_.source_->AddMotion(
          link_.get(), motion.time_ns(),
          {0, ToVector(motion.acceleration_m_s2()), ToVector(motion.angular_velocity_rad_s())});
    }
  }

  void OnTick() override {
    if (link_->ended()) return;
    if (crowded_) return link_->Refuse("too many links that have not said hello yet", false);
    if (!let_in_) {
      if (MonotonicNow() - begun_ns_ > kHelloTakes_ns) link_->Refuse("no hello came", false);
      return;
    }
    if (absl::Status may = May().status(); !may.ok()) {
      link_->Refuse(std::string(may.message()), true);
    }
  }

 private:
  absl::StatusOr<Access> May() const {
    absl::StatusOr<Access> access = entrance_.access_.Check(token_);
    if (!access.ok()) return access;
    const AccessRole least = LeastRole(kWhat).value_or(AccessRole::kOwner);
    if (access->role >= least) return access;
    return absl::PermissionDeniedError(
        absl::StrCat("access: to be the camera takes the role ", Word(least), ", and yours is ",
                     Word(access->role), "; ask for a wearer's link"));
  }

  void Record(const std::string& outcome) {
    AuditFacts facts;
    if (link_->access_id.empty()) return;  // of strangers nothing: they would fill the book
    facts.access_id = link_->access_id;
    facts.call = kWhat;
    facts.outcome = outcome;
    entrance_.access_.Record(std::move(facts));
  }

  void OnHello(const v1::WearerHello& hello) {
    token_ = hello.token();
    if (const auto known = entrance_.access_.Check(token_); known.ok()) {
      link_->access_id = known->id;
    }
    const absl::StatusOr<Access> access = May();
    if (!access.ok()) {
      Record(std::string(access.status().message()));
      return link_->Refuse(std::string(access.status().message()), true);
    }
    if (entrance_.source_ == nullptr) {
      return link_->Refuse(absl::StrCat("this server has another camera, ", entrance_.other_,
                                        "; the wearer's view is at /wearer"),
                           true);
    }
    if (hello.phone_id().size() > kMostId || hello.camera_label().size() > kMostLabel) {
      return link_->Refuse("hello: phone_id or camera_label is too long", true);
    }
    link_->phone_id = hello.phone_id();
    if (!entrance_.TakeOver(link_)) {
      Record("refused: another phone is the camera");
      return link_->Refuse(
          "another phone is the camera now; it has to leave /wear first, or lose its network for "
          "some seconds",
          false);
    }
    let_in_ = true;
    if (std::exchange(stranger_, false)) entrance_.Depart(link_->peer());
    Record("ok");
    Log(absl::StrCat("phone ", link_->peer(), ": is the camera now (",
                     Printable(hello.camera_label()), ")"));
    v1::WearerDownstream message;
    v1::WearerWelcome& welcome = *message.mutable_welcome();
    const CameraIntrinsics& lens = entrance_.source_->info().camera->intrinsics();
    welcome.set_width(static_cast<std::uint32_t>(lens.width));
    welcome.set_height(static_cast<std::uint32_t>(lens.height));
    welcome.set_fps_hz(static_cast<std::uint32_t>(lens.fps));
    *welcome.mutable_intrinsics() = wire::ToProto(lens);
    link_->Send(message);
  }

  void OnPicture(v1::WearerPicture& picture, Timestamp now_ns) {
    const std::uint32_t turn = picture.clockwise_deg();
    const bool known =
        picture.codec() == v1::WEARER_CODEC_H264 || picture.codec() == v1::WEARER_CODEC_VP8;
    if (!known || turn % 90 != 0 || turn > 270) {
      return link_->Refuse("picture: codec is H.264 or VP8, clockwise_deg 0, 90, 180 or 270", true);
    }
    CodedPicture coded;
    coded.picture_id = picture.picture_id();
    coded.codec = CodecOf(picture.codec());
    coded.key_frame = picture.key_frame();
    coded.capture_ns = picture.capture_ns();
    coded.clockwise_deg = static_cast<int>(turn);
    coded.data = std::move(*picture.mutable_data());
    coded.received_ns = now_ns;
    entrance_.source_->Offer(link_.get(), std::move(coded));
  }

  void OnPing(const v1::WearerPing& ping, Timestamp now_ns) {
    // Only what we said ourselves: an invented echo would bend the clock.
    if (ping.echo_server_ns() != 0 && ping.echo_server_ns() == last_pong_ns_) {
      entrance_.source_->AddPing(link_.get(), last_pong_ns_, ping.echo_arrived_ns(), ping.sent_ns(),
                                 now_ns);
    }
    v1::WearerDownstream message;
    last_pong_ns_ = MonotonicNow();
    message.mutable_pong()->set_echo_sent_ns(ping.sent_ns());
    message.mutable_pong()->set_server_ns(last_pong_ns_);
    link_->Send(message);
  }

  WearerEntrance& entrance_;
  const std::shared_ptr<PhoneLinkImpl> link_;
  const Timestamp begun_ns_ = MonotonicNow();
  std::string token_;
  bool let_in_ = false;
  bool stranger_;       // counted among those without a hello
  const bool crowded_;  // too many of them
  Timestamp last_pong_ns_ = 0;
  Rate rate_;
};

WearerEntrance::WearerEntrance(AccessBook& access, PhoneSource* source, std::string other)
    : access_(access), source_(source), other_(std::move(other)) {}

WearerEntrance::~WearerEntrance() = default;

std::unique_ptr<WearerPort::Link> WearerEntrance::Open(const std::string& peer,
                                                       std::shared_ptr<Out> out) {
  return std::make_unique<Conversation>(*this, peer, std::move(out));
}

bool WearerEntrance::Arrive(const std::string& peer) {
  const std::string key = PeerKey(peer);
  const std::lock_guard lock(mutex_);
  // A proxy on this machine brings everybody by one address.
  const bool crowded = strangers_.size() >= kMostStrangers ||
                       (!IsThisMachine(key) && strangers_.count(key) >= kMostStrangersOfPeer);
  if (!crowded) strangers_.insert(key);
  return !crowded;
}

void WearerEntrance::Depart(const std::string& peer) {
  const std::lock_guard lock(mutex_);
  if (const auto found = strangers_.find(PeerKey(peer)); found != strangers_.end())
    strangers_.erase(found);
}

bool WearerEntrance::TakeOver(const std::shared_ptr<PhoneLinkImpl>& link) {
  std::shared_ptr<PhoneLinkImpl> before;
  {
    const std::lock_guard lock(mutex_);
    const bool own = holder_ && holder_->access_id == link->access_id &&
                     holder_->phone_id == link->phone_id && !link->phone_id.empty();
    if (holder_ && !holder_->ended() && !own) return false;
    before = std::exchange(holder_, link);
    source_->Begin(link);
  }
  if (before) before->Refuse("this phone came back by another link, or in another tab", true);
  return true;
}

void WearerEntrance::Leave(const PhoneLinkImpl* link) {
  const std::lock_guard lock(mutex_);
  if (holder_.get() != link) return;
  source_->End(link);
  Log(absl::StrCat("phone ", holder_->peer(), ": gone; waiting for it"));
  holder_.reset();
}

void WearerEntrance::OnTracked(const TrackedEvent& event) {
  if (source_ == nullptr) return;
  const std::optional<PhonePicture> picture = source_->Find(event.snapshot->frame_id);
  std::shared_ptr<PhoneLinkImpl> link;
  {
    const std::lock_guard lock(mutex_);
    link = holder_;
  }
  if (!link || !picture) return;
  const PhoneCounts counts = source_->counts();
  v1::WearerDownstream message;
  v1::WearerTracked& tracked = *message.mutable_tracked();
  tracked.set_picture_id(picture->picture_id);
  tracked.set_received_ns(picture->received_ns);
  tracked.set_decoded_ns(picture->decoded_ns);
  tracked.set_tracked_ns(event.stages.tracked_ns);
  *tracked.mutable_pose() = wire::ToProtoPose(*event.snapshot, event.stages.captured_ns);
  tracked.set_pictures_dropped(counts.dropped);
  tracked.set_pictures_bad(counts.bad);
  link->Send(message);
}

}  // namespace saccade
