#pragma once
// The viewer: passes the messages of a source to its clients, and serves the page, the timeline,
// explanations and metrics.

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "modules/sp/scan/range_image.h"
#include "tools/view/run_status.h"
#include "tools/view/run_timeline.h"
#include "tools/view/server/http_server.h"
#include "tools/view/server/subscription_table.h"
#include "tools/view/source/source.h"
#include "tools/view/topic_publisher.h"

namespace rcs::view {

class Viewer final : public HttpHandler, public WebSocketOwner, private SourceSink {
 public:
  static constexpr std::size_t kMaxClients = 64;
  /// A client that does not read a message for this time is dropped.
  static constexpr std::chrono::milliseconds kStall{10000};

  struct Options {
    std::string version;
    std::optional<sp::LadarParams> ladar;            ///< calibration, for points of LADAR_RANGES
    std::function<void(const std::string&)> report;  ///< receives one line for people
    std::function<void(const std::string&)> failed;  ///< the source has ended, and why
  };

  /// Source and timeline outlive the viewer.
  Viewer(boost::asio::io_context* io, Source* source, const RunTimeline* timeline, Options options);

  void start();
  void stop();
  [[nodiscard]] ViewerCounts counts() const;

  HttpResponse respond(std::string_view target) override;
  void on_open(WebSocketSession* session) override;
  void on_text(WebSocketSession* session, std::string_view text) override;
  void on_close(WebSocketSession* session) override;

 private:
  /// A client of kFoxgloveProtocol.
  struct Subscriber {
    explicit Subscriber(const TopicTable* topics) : table(topics) {}
    SubscriptionTable table;
    std::int64_t reported_drops = 0;
  };

  void on_message(const SourceMessage& message) override;
  void on_jump() override;
  void on_state() override;
  void on_failure(const std::string& reason) override;

  void on_request(WebSocketSession* session, Subscriber* subscriber, std::string_view text);
  void on_control(WebSocketSession* session, std::string_view text);
  void tick();
  void check_clients();
  void renew_publisher();
  void update_sources();
  /// Sends the present state of the topics to one client, or to all.
  void send_state(WebSocketSession* only, const std::vector<std::uint32_t>& topics);
  void publish(const TopicInfo& topic, std::uint64_t time_ns, const Payload& payload);
  void broadcast_state();
  [[nodiscard]] std::string source_text() const;
  [[nodiscard]] std::string state_text();
  [[nodiscard]] HttpResponse timeline_response(std::string_view query);
  [[nodiscard]] HttpResponse pair_response(std::string_view query);

  Source* source_;
  const RunTimeline* timeline_;
  Options options_;
  TopicTable topics_;
  std::unique_ptr<TopicPublisher> publisher_;
  RunStatus status_;
  std::map<WebSocketSession*, Subscriber> subscribers_;
  std::set<WebSocketSession*> controls_;
  ChannelSet standard_ = 0;  // channels that some client needs
  ChannelSet original_ = 0;
  ViewerCounts ended_;  // of clients that are gone
  std::int64_t received_ = 0;
  boost::asio::steady_timer timer_;
  int ticks_ = 0;
  std::shared_ptr<const std::string> whole_timeline_;  // of a log
};

}  // namespace rcs::view
