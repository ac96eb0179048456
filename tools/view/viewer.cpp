#include "tools/view/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "tools/view/server/control_protocol.h"
#include "tools/view/server/foxglove_protocol.h"
#include "tools/view/server/page_files.h"
#include "tools/view/server/query.h"

namespace rcs::view {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::chrono::milliseconds kTick{200};
constexpr char kJsonType[] = "application/json";

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

Viewer::Viewer(boost::asio::io_context* io, Source* source, const RunTimeline* timeline,
               Options options)
    : source_(source), timeline_(timeline), options_(std::move(options)), timer_(*io) {}

void Viewer::start() {
  renew_publisher();
  if (!source_->live()) {
    whole_timeline_ = std::make_shared<const std::string>(text_of(timeline_->json(Duration{-1})));
  }
  source_->start(this);
  if (!source_->live()) source_->seek(Duration{});
  tick();
}

void Viewer::stop() {
  timer_.cancel();
  std::vector<WebSocketSession*> sessions(controls_.begin(), controls_.end());
  for (const auto& [session, subscriber] : subscribers_) sessions.push_back(session);
  for (WebSocketSession* session : sessions) session->drop();
}

void Viewer::renew_publisher() {
  publisher_ = std::make_unique<TopicPublisher>(
      &topics_, source_->clocks(), options_.ladar,
      [this](const TopicInfo& topic, std::uint64_t time_ns, const Payload& payload) {
        publish(topic, time_ns, payload);
      });
}

void Viewer::publish(const TopicInfo& topic, std::uint64_t time_ns, const Payload& payload) {
  for (auto& [session, subscriber] : subscribers_) {
    WebSocketSession* const to = session;
    subscriber.table.for_each_of(topic.id,
                                 [&](std::uint32_t id) { to->send(id, time_ns, payload); });
  }
}

void Viewer::on_message(const SourceMessage& message) {
  ++received_;
  status_.add(message);
  publisher_->add(message, standard_, original_);
}

void Viewer::on_jump() {
  status_.clear();
  ended_.malformed += publisher_->malformed();
  renew_publisher();
  source_->state(status_channels(), [this](const SourceMessage& m) { status_.add(m); });
  if (!subscribers_.empty()) send_state(nullptr, {});
}

void Viewer::send_state(WebSocketSession* only, const std::vector<std::uint32_t>& topics) {
  ChannelSet standard = standard_;
  ChannelSet original = original_;
  if (only != nullptr) {
    standard = original = 0;
    for (const std::uint32_t id : topics) {
      const TopicInfo* info = topics_.find(id);
      (info->original ? original : standard) |= info->sources;
    }
  }
  // Of each topic only the newest message describes the moment.
  std::map<std::uint32_t, std::pair<std::uint64_t, Payload>> newest;
  TopicPublisher moment(&topics_, source_->clocks(), options_.ladar,
                        [&](const TopicInfo& topic, std::uint64_t time_ns, const Payload& payload) {
                          newest[topic.id] = {time_ns, payload};
                        });
  source_->state(standard | original,
                 [&](const SourceMessage& m) { moment.add(m, standard, original); });
  for (const auto& [id, message] : newest) {
    if (only == nullptr) {
      publish(*topics_.find(id), message.first, message.second);
    } else if (std::find(topics.begin(), topics.end(), id) != topics.end()) {
      // A client that does not read is dropped, possibly by the answer before.
      const auto to = subscribers_.find(only);
      if (to == subscribers_.end()) return;
      to->second.table.for_each_of(
          id, [&](std::uint32_t sub) { only->send(sub, message.first, message.second); });
    }
  }
}

void Viewer::on_state() { broadcast_state(); }

void Viewer::on_failure(const std::string& reason) {
  const std::string text = status_message(StatusLevel::kError, reason);
  // send_text() may drop a client, which removes it.
  std::vector<WebSocketSession*> sessions;
  for (const auto& [session, subscriber] : subscribers_) sessions.push_back(session);
  for (WebSocketSession* session : sessions) session->send_text(text);
  options_.failed(reason);
}

void Viewer::on_open(WebSocketSession* session) {
  if (subscribers_.size() + controls_.size() >= kMaxClients) {
    options_.report(
        fmt::format("client {} refused: {} clients are connected", session->peer(), kMaxClients));
    session->drop();
    return;
  }
  if (session->protocol() == kControlProtocol) {
    controls_.insert(session);
    session->send_text(source_text());
    session->send_text(state_text());
    return;
  }
  subscribers_.emplace(session, Subscriber(&topics_));
  session->send_text(
      server_info("rcs view: " + source_->name(), fmt::format("{}", source_->begin_utime())));
  session->send_text(advertisement(topics_, source_->channels()));
}

void Viewer::on_close(WebSocketSession* session) {
  ended_.messages_sent += session->messages_sent();
  ended_.bytes_sent += session->bytes_sent();
  ended_.messages_dropped += session->queue().dropped();
  controls_.erase(session);
  subscribers_.erase(session);
  update_sources();
}

void Viewer::update_sources() {
  standard_ = original_ = 0;
  for (const auto& [session, subscriber] : subscribers_) {
    standard_ |= subscriber.table.sources(false);
    original_ |= subscriber.table.sources(true);
  }
}

void Viewer::on_text(WebSocketSession* session, std::string_view text) {
  const auto subscriber = subscribers_.find(session);
  if (subscriber != subscribers_.end()) {
    on_request(session, &subscriber->second, text);
  } else {
    on_control(session, text);
  }
}

void Viewer::on_request(WebSocketSession* session, Subscriber* subscriber, std::string_view text) {
  const ClientRequest request = parse_request(text);
  const auto warn = [session](const std::string& problem) {
    session->send_text(status_message(StatusLevel::kWarning, problem));
  };
  if (!request.problem.empty()) return warn(request.problem);
  std::vector<std::uint32_t> added;
  std::string problem;
  for (const ClientRequest::Subscription& s : request.subscribe) {
    switch (subscriber->table.add(s.id, s.topic)) {
      case SubscriptionTable::Added::kDone:
        added.push_back(s.topic);
        break;
      case SubscriptionTable::Added::kUnknownTopic:
        problem = fmt::format("subscription {}: no channel {}", s.id, s.topic);
        break;
      case SubscriptionTable::Added::kUsedId:
        problem = fmt::format("subscription {}: the id is used already", s.id);
        break;
      case SubscriptionTable::Added::kTooMany:
        problem = fmt::format("subscription {}: more than {} subscriptions", s.id,
                              SubscriptionTable::kMax);
        break;
    }
  }
  for (const std::uint32_t id : request.unsubscribe) {
    if (!subscriber->table.remove(id)) problem = fmt::format("unsubscribe: no subscription {}", id);
    session->forget(id);
  }
  update_sources();
  if (!problem.empty()) warn(problem);
  if (!added.empty()) send_state(session, added);
}

void Viewer::on_control(WebSocketSession* session, std::string_view text) {
  const ControlRequest request = parse_control(text);
  if (request.kind != ControlRequest::Kind::kProblem && source_->live()) {
    session->send_text(
        text_of({{"op", "error"}, {"message", "a bus has only the present moment"}}));
    return;
  }
  switch (request.kind) {
    case ControlRequest::Kind::kProblem:
      session->send_text(text_of({{"op", "error"}, {"message", request.problem}}));
      break;
    case ControlRequest::Kind::kPlay:
      source_->play();
      break;
    case ControlRequest::Kind::kPause:
      source_->pause();
      break;
    case ControlRequest::Kind::kSeek:
      source_->seek(from_seconds(request.value));
      break;
    case ControlRequest::Kind::kSpeed:
      source_->set_speed(request.value);
      break;
  }
}

void Viewer::tick() {
  if (source_->playing()) broadcast_state();
  if (++ticks_ % 5 == 0) check_clients();
  timer_.expires_after(kTick);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) tick();
  });
}

void Viewer::check_clients() {
  constexpr int kMaxStalled = static_cast<int>(kStall / (5 * kTick));
  std::vector<WebSocketSession*> stalled;
  const auto check = [&](WebSocketSession* session) {
    if (session->stalled_for() > kMaxStalled) stalled.push_back(session);
  };
  for (WebSocketSession* session : controls_) check(session);
  for (auto& [session, subscriber] : subscribers_) {
    check(session);
    const std::int64_t dropped = session->queue().dropped();
    if (dropped == subscriber.reported_drops) continue;
    // Once a second at most, and only while messages are dropped.
    const std::string text = status_message(
        StatusLevel::kWarning,
        fmt::format(
            "{} messages were replaced by newer ones, because this client reads more slowly "
            "than they are published",
            dropped - subscriber.reported_drops));
    subscriber.reported_drops = dropped;
    if (session->queue().bytes() < WebSocketSession::kMaxWaitingBytes / 2) session->send_text(text);
  }
  for (WebSocketSession* session : stalled) {
    ++ended_.clients_dropped;
    options_.report(fmt::format("client {} dropped: it has read nothing for {} s", session->peer(),
                                std::chrono::duration_cast<std::chrono::seconds>(kStall).count()));
    session->drop();
  }
}

ViewerCounts Viewer::counts() const {
  ViewerCounts counts = ended_;
  counts.messages_received = received_;
  counts.malformed += publisher_ ? publisher_->malformed() : 0;
  const auto add = [&counts](const WebSocketSession& session) {
    ++counts.clients;
    counts.messages_sent += session.messages_sent();
    counts.bytes_sent += session.bytes_sent();
    counts.messages_dropped += session.queue().dropped();
    counts.bytes_waiting += static_cast<std::int64_t>(session.queue().bytes());
  };
  for (const WebSocketSession* session : controls_) add(*session);
  for (const auto& [session, subscriber] : subscribers_) add(*session);
  return counts;
}

std::string Viewer::source_text() const {
  return text_of({{"op", "source"},
                  {"live", source_->live()},
                  {"name", source_->name()},
                  {"begin_utime", source_->begin_utime()},
                  {"duration_s", source_->live() ? Json() : Json(seconds(source_->duration()))},
                  {"version", options_.version}});
}

std::string Viewer::state_text() {
  const ViewerCounts c = counts();
  Json status = to_json(status_.view(source_->time()));
  return text_of({{"op", "state"},
                  {"t", seconds(source_->time())},
                  {"playing", source_->playing()},
                  {"speed", source_->speed()},
                  {"status", std::move(status)},
                  {"viewer", {{"clients", c.clients}, {"dropped", c.messages_dropped}}}});
}

void Viewer::broadcast_state() {
  if (controls_.empty()) return;
  const std::string text = state_text();
  // send_text() may drop a client, which removes it.
  const std::vector<WebSocketSession*> sessions(controls_.begin(), controls_.end());
  for (WebSocketSession* session : sessions) session->send_text(text);
}

HttpResponse Viewer::timeline_response(std::string_view query) {
  const std::optional<double> since_s = number_of(query, "since");
  if (whole_timeline_ && !since_s) return {200, kJsonType, whole_timeline_};
  const Duration since = since_s ? from_seconds(*since_s) : Duration{-1};
  return HttpResponse::of(kJsonType, text_of(timeline_->json(since)));
}

HttpResponse Viewer::pair_response(std::string_view query) {
  const std::optional<double> t = number_of(query, "t");
  if (!t) return HttpResponse::refused(400, "/api/pairs needs t=SECONDS");
  const double apart = number_of(query, "apart").value_or(ScanPairRequest{}.apart);
  if (apart < 1.0 || apart > kMaxApart) {
    return HttpResponse::refused(400, fmt::format("/api/pairs: apart is 1 to {}", kMaxApart));
  }
  const bool by_wm = number_of(query, "wm").value_or(0.0) != 0.0;
  const Result<Json> pair = source_->pair({from_seconds(*t), static_cast<int>(apart), by_wm});
  if (!pair) return HttpResponse::refused(404, pair.error().message);
  return HttpResponse::of(kJsonType, text_of(*pair));
}

HttpResponse Viewer::respond(std::string_view target) {
  const std::string_view path = path_of(target);
  const std::string_view query = query_of(target);
  if (path == "/metrics") {
    return HttpResponse::of("text/plain; version=0.0.4; charset=utf-8",
                            metrics_text(status_.view(source_->time()), counts()));
  }
  if (path == "/api/timeline") return timeline_response(query);
  if (path == "/api/scans") {
    const std::optional<double> t = number_of(query, "t");
    if (!t) return HttpResponse::refused(400, "/api/scans needs t=SECONDS");
    return HttpResponse::of("application/octet-stream", source_->recent_scans(from_seconds(*t)));
  }
  if (path == "/api/pairs") return pair_response(query);
  if (path == "/api/why") {
    const std::optional<double> t = number_of(query, "t");
    if (!t) return HttpResponse::refused(400, "/api/why needs t=SECONDS");
    return HttpResponse::of(kJsonType, text_of(source_->explain(from_seconds(*t))));
  }
  const PageFile* file = find_page_file(path);
  if (file == nullptr) return HttpResponse::refused(404, "not found");
  return HttpResponse::of(std::string(file->type), std::string(file->content));
}

}  // namespace rcs::view
