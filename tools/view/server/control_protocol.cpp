#include "tools/view/server/control_protocol.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace rcs::view {
namespace {

using Json = nlohmann::json;

ControlRequest refused(std::string problem) {
  ControlRequest request;
  request.problem = std::move(problem);
  return request;
}

ControlRequest with_number(ControlRequest::Kind kind, const Json& json, const char* name) {
  const auto at = json.find(name);
  if (at == json.end() || !at->is_number() || !std::isfinite(at->get<double>())) {
    return refused(std::string("a finite number \"") + name + "\" is missing");
  }
  return {kind, at->get<double>(), ""};
}

}  // namespace

ControlRequest parse_control(std::string_view text) {
  using Kind = ControlRequest::Kind;
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return refused("not a JSON object");
  const auto op = json.find("op");
  if (op == json.end() || !op->is_string()) return refused("a text \"op\" is missing");
  if (*op == "play") return {Kind::kPlay, 0.0, ""};
  if (*op == "pause") return {Kind::kPause, 0.0, ""};
  if (*op == "seek") return with_number(Kind::kSeek, json, "t");
  if (*op == "speed") return with_number(Kind::kSpeed, json, "value");
  return refused("unknown operation; known are play, pause, seek, speed");
}

}  // namespace rcs::view
