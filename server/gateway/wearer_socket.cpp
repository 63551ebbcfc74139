#include "server/gateway/wearer_socket.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <chrono>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

namespace beast = boost::beast;
namespace net = boost::asio;
namespace websocket = beast::websocket;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;

constexpr char kPath[] = "/wear/upstream";
constexpr std::chrono::milliseconds kTick(100);
constexpr std::chrono::milliseconds kEnding(500);  // for the last words to go out
constexpr std::chrono::seconds kHandshake(5), kSilence(8);
constexpr std::size_t kMostWaiting = 64;  // messages that the phone has not taken

/// The way to a socket that may be gone: others hold it longer than the gateway lives.
class Mailbox final : public WearerPort::Out {
 public:
  using Post = std::function<void(std::function<void()>)>;
  struct Socket {
    std::function<void(std::string)> send;
    std::function<void(std::string)> end;
  };

  Mailbox(Post post, Socket socket) : post_(std::move(post)), socket_(std::move(socket)) {}

  void Send(std::string message) override {
    const std::lock_guard lock(mutex_);
    if (socket_) post_([send = socket_->send, text = std::move(message)] { send(text); });
  }
  void End(const std::string& reason) override {
    const std::lock_guard lock(mutex_);
    if (socket_) post_([end = socket_->end, reason] { end(reason); });
  }
  /// The socket has ended: nothing is posted any more.
  void Close() {
    const std::lock_guard lock(mutex_);
    socket_.reset();
  }

 private:
  std::mutex mutex_;
  const Post post_;
  std::optional<Socket> socket_;
};

template <class Stream>
class Socket final : public std::enable_shared_from_this<Socket<Stream>> {
 public:
  Socket(Stream& stream, WearerUpgrade upgrade)
      : upgrade_(std::move(upgrade)), socket_(stream), timer_(socket_.get_executor()) {}

  void Begin(WearerPort& port) {
    upgrade_.tcp.expires_never();  // the WebSocket has its own
    websocket::stream_base::timeout timeouts{kHandshake, kSilence, /*keep_alive_pings=*/true};
    socket_.set_option(timeouts);
    socket_.binary(true);
    const auto self = this->shared_from_this();
    mailbox_ = std::make_shared<Mailbox>(
        [executor = socket_.get_executor()](std::function<void()> task) {
          net::post(executor, std::move(task));
        },
        Mailbox::Socket{
            [self](std::string text) { self->Guarded([&] { self->Send(std::move(text)); }); },
            [self](std::string why) { self->Guarded([&] { self->EndSoon(std::move(why)); }); }});
    link_ = port.Open(upgrade_.peer, mailbox_);
    socket_.async_accept(upgrade_.request, [self](error_code error) {
      self->Guarded([&] {
        if (error) return self->Finish();
        self->Tick();
        self->Read();
      });
    });
  }

 private:
  // Whatever is thrown below costs this connection only.
  template <class Work>
  void Guarded(Work work) {
    try {
      work();
    } catch (const std::exception& thrown) {
      Log(absl::StrCat("gateway: ", upgrade_.peer, ": ", Printable(thrown.what())));
      Finish();
    }
  }

  void Read() {
    socket_.read_message_max(link_->most_bytes());
    socket_.async_read(buffer_, [self = this->shared_from_this()](error_code error, std::size_t) {
      self->Guarded([&] { self->OnRead(error); });
    });
  }

  void OnRead(error_code error) {
    if (error || !link_) return Finish();
    const auto bytes = buffer_.cdata();
    link_->OnMessage({static_cast<const char*>(bytes.data()), bytes.size()});
    buffer_.consume(buffer_.size());
    Read();
  }

  void Tick() {
    timer_.expires_after(kTick);
    timer_.async_wait([self = this->shared_from_this()](error_code error) {
      self->Guarded([&] {
        if (error || !self->link_) return;
        if (self->end_at_ && Clock::now() > *self->end_at_) return self->Finish();
        self->link_->OnTick();
        self->Tick();
      });
    });
  }

  void Send(std::string message) {
    if (!link_ || end_at_ || waiting_.size() >= kMostWaiting) return;
    waiting_.push_back(std::move(message));
    Write();
  }

  void EndSoon(std::string reason) {
    if (!link_ || end_at_) return;
    end_at_ = Clock::now() + kEnding;
    reason_ = std::move(reason);
    Write();
  }

  void Write() {
    if (writing_) return;
    if (waiting_.empty()) return end_at_ ? CloseNow() : void();
    writing_ = true;
    socket_.async_write(net::buffer(waiting_.front()),
                        [self = this->shared_from_this()](error_code error, std::size_t) {
                          self->Guarded([&] {
                            self->writing_ = false;
                            if (error || !self->link_) return self->Finish();
                            self->waiting_.pop_front();
                            self->Write();
                          });
                        });
  }

  void CloseNow() {
    writing_ = true;  // nothing may follow
    const websocket::close_reason why(websocket::close_code::policy_error, reason_);
    socket_.async_close(why, [self = this->shared_from_this()](error_code) {
      self->Guarded([&] { self->Finish(); });
    });
  }

  void Finish() {
    if (!std::exchange(link_, nullptr)) return;
    mailbox_->Close();
    timer_.cancel();
    upgrade_.on_ended();
  }

  WearerUpgrade upgrade_;
  websocket::stream<Stream&> socket_;
  net::steady_timer timer_;
  std::shared_ptr<Mailbox> mailbox_;
  std::unique_ptr<WearerPort::Link> link_;  // null: over
  beast::flat_buffer buffer_;
  std::deque<std::string> waiting_;
  bool writing_ = false;
  std::optional<Clock::time_point> end_at_;
  std::string reason_;
};

template <class Stream>
void Start(Stream& stream, WearerUpgrade upgrade, WearerPort& port) {
  std::make_shared<Socket<Stream>>(stream, std::move(upgrade))->Begin(port);
}

}  // namespace

bool IsWearerUpgrade(const HttpRequestReader::Request& request) {
  const beast::string_view target = request.target();
  return target.substr(0, target.find('?')) == kPath && websocket::is_upgrade(request);
}

void StartWearerSocket(WearerUpgrade upgrade, WearerPort& port) {
  if (upgrade.tls != nullptr) {
    TlsStream& tls = *upgrade.tls;
    return Start(tls, std::move(upgrade), port);
  }
  beast::tcp_stream& tcp = upgrade.tcp;
  Start(tcp, std::move(upgrade), port);
}

}  // namespace saccade
