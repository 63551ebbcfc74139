// Subscribes several times, decodes everything and prints capture-to-decoded latency by stage.
//   stream-probe --server HOST:PORT [--subscribers 5] [--seconds 20] [--stall-s 0]
// With --stall-s, subscriber 0 stops reading for so long, 2 s after its start, its socket open.
#include <grpcpp/grpcpp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "saccade/v1/session.grpc.pb.h"
#include "shared/time/timestamp.hpp"
#include "tests/support/h264/h264_reader.hpp"

namespace saccade::testing {
namespace {

constexpr std::array<const char*, 7> kStages = {
    "capture_to_received", "received_to_tracked", "tracked_to_encoded", "encoded_to_queued",
    "queued_to_arrived",   "arrived_to_decoded",  "capture_to_decoded"};

struct Options {
  std::string server = "127.0.0.1:50051";
  int subscribers = 5;
  double seconds = 20.0;
  double stall_s = 0.0;
};

struct Report {
  std::array<std::vector<double>, kStages.size()> ms;
  int units = 0, missing = 0, undecodable = 0, sequence_gaps = 0;
  double worst_age_s = 0.0;        // of a unit on arrival, from one second after a stall
  double stall_backlog_units = 0;  // units older than 1 s on arrival
};

class Probe {
 public:
  Probe(const Options& options, bool stalls) : options_(options), stalls_(stalls) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetInt("grpc.http2.bdp_probe", 0);
    arguments.SetMaxReceiveMessageSize(-1);
    stub_ = v1::SessionService::NewStub(
        grpc::CreateCustomChannel(options.server, grpc::InsecureChannelCredentials(), arguments));
  }

  bool Run() {
    v1::JoinResponse joined;
    grpc::ClientContext join_context;
    v1::JoinRequest join;
    join.set_display_name("probe");
    join.set_role(v1::ROLE_VIEWER);
    const grpc::Status status = stub_->Join(&join_context, join, &joined);
    if (!status.ok()) {
      std::fprintf(stderr, "stream-probe: %s: %s\n", options_.server.c_str(),
                   status.error_message().c_str());
      return false;
    }
    session_id_ = joined.session_id();
    MeasureOffset();
    grpc::ClientContext context;
    v1::SubscribeRequest request;
    request.set_session_id(session_id_);
    const auto reader = stub_->Subscribe(&context, request);
    const Timestamp begin_ns = MonotonicNow();
    v1::Event event;
    bool stalled = false;
    while (Seconds(MonotonicNow() - begin_ns) < options_.seconds && reader->Read(&event)) {
      Take(event);
      if (stalls_ && !stalled && Seconds(MonotonicNow() - begin_ns) > 2.0) {
        stalled = true;
        std::this_thread::sleep_for(std::chrono::duration<double>(options_.stall_s));
        resumed_ns_ = MonotonicNow();
        last_frame_.reset();
      }
    }
    context.TryCancel();
    reader->Finish();
    return true;
  }

  const Report& report() const { return report_; }

 private:
  // The exchange with the shortest round trip.
  void MeasureOffset() {
    Timestamp best_ns = INT64_MAX;
    for (int i = 0; i < 8; ++i) {
      grpc::ClientContext context;
      v1::PingRequest request;
      request.set_client_send_ns(MonotonicNow());
      v1::PingResponse response;
      if (!stub_->Ping(&context, request, &response).ok()) continue;
      const Timestamp now_ns = MonotonicNow();
      const Timestamp round_ns = now_ns - request.client_send_ns();
      if (round_ns >= best_ns) continue;
      best_ns = round_ns;
      offset_ns_ = ((response.server_receive_ns() - request.client_send_ns()) +
                    (response.server_send_ns() - now_ns)) /
                   2;
    }
  }

  void Take(const v1::Event& event) {
    const Timestamp arrived_ns = MonotonicNow() + offset_ns_;
    if (event.sequence() != ++sequence_) ++report_.sequence_gaps;
    if (event.has_access_unit()) TakeUnit(event.access_unit(), arrived_ns);
    if (event.sequence() % 4 != 0) return;
    grpc::ClientContext context;
    v1::AcknowledgeRequest request;
    request.set_session_id(session_id_);
    request.set_sequence(event.sequence());
    v1::AcknowledgeResponse response;
    stub_->Acknowledge(&context, request, &response);
  }

  void TakeUnit(const v1::AccessUnit& unit, Timestamp arrived_ns) {
    const bool decoded = !reader_.DecodeLuma(unit.data()).empty();
    const Timestamp decoded_ns = MonotonicNow() + offset_ns_;
    ++report_.units;
    if (!decoded) ++report_.undecodable;
    if (last_frame_ && unit.frame_id() > *last_frame_ + 1) {
      report_.missing += static_cast<int>(unit.frame_id() - *last_frame_ - 1);
    }
    last_frame_ = unit.frame_id();
    const v1::StageTimestamps& at = unit.stages();
    const double age_s = Seconds(arrived_ns - at.captured_ns());
    if (resumed_ns_ != 0) {
      if (age_s > 1.0) ++report_.stall_backlog_units;
      if (Seconds(arrived_ns - offset_ns_ - resumed_ns_) > 1.0) {
        report_.worst_age_s = std::max(report_.worst_age_s, age_s);
      }
      return;
    }
    const std::array<Timestamp, 7> times = {at.captured_ns(), at.received_ns(), at.tracked_ns(),
                                            at.encoded_ns(),  at.queued_ns(),   arrived_ns,
                                            decoded_ns};
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
      report_.ms[i].push_back(1e3 * Seconds(times[i + 1] - times[i]));
    }
    report_.ms.back().push_back(1e3 * Seconds(decoded_ns - at.captured_ns()));
  }

  const Options& options_;
  const bool stalls_;
  std::unique_ptr<v1::SessionService::Stub> stub_;
  std::string session_id_;
  Timestamp offset_ns_ = 0, resumed_ns_ = 0;
  std::uint64_t sequence_ = 0;
  std::optional<std::uint64_t> last_frame_;
  H264Reader reader_;
  Report report_;
};

double Percentile(std::vector<double>& values, double fraction) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1) + 0.5)];
}

nlohmann::ordered_json ToJson(const std::vector<std::unique_ptr<Probe>>& probes) {
  nlohmann::ordered_json out;
  for (std::size_t stage = 0; stage < kStages.size(); ++stage) {
    std::vector<double> all;
    for (const auto& probe : probes) {
      const std::vector<double>& ms = probe->report().ms[stage];
      all.insert(all.end(), ms.begin(), ms.end());
    }
    out["ms"][kStages[stage]] = {{"p50", Percentile(all, 0.5)}, {"p95", Percentile(all, 0.95)}};
  }
  for (const auto& probe : probes) {
    const Report& report = probe->report();
    out["subscribers"].push_back({{"units", report.units},
                                  {"missing", report.missing},
                                  {"undecodable", report.undecodable},
                                  {"sequence_gaps", report.sequence_gaps},
                                  {"old_units_after_stall", report.stall_backlog_units},
                                  {"worst_age_s_after_stall", report.worst_age_s}});
  }
  return out;
}

}  // namespace
}  // namespace saccade::testing

int main(int argc, char** argv) {
  using namespace saccade::testing;
  Options options;
  CLI::App app("Measures capture-to-decoded latency of a Saccade server.", "stream-probe");
  app.add_option("--server", options.server, "HOST:PORT");
  app.add_option("--subscribers", options.subscribers, "streams, each with its own socket");
  app.add_option("--seconds", options.seconds, "how long");
  app.add_option("--stall-s", options.stall_s, "subscriber 0 stops reading for so long");
  CLI11_PARSE(app, argc, argv);
  std::vector<std::unique_ptr<Probe>> probes;
  std::vector<std::thread> threads;
  std::atomic<bool> good = true;
  for (int i = 0; i < options.subscribers; ++i) {
    probes.push_back(std::make_unique<Probe>(options, i == 0 && options.stall_s > 0));
    threads.emplace_back([probe = probes.back().get(), &good] {
      if (!probe->Run()) good = false;
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::printf("%s\n", ToJson(probes).dump(2).c_str());
  return good ? 0 : 1;
}
