#include "rcs/zones/zone_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "rcs/base/printable.h"
#include "rcs/base/regular_file.h"
#include "rcs/zones/ring_check.h"

namespace rcs {
namespace {

using nlohmann::json;

constexpr int kMaxDepth = 64;                // GeoJSON needs 8, properties are free
constexpr std::size_t kMaxValues = 400'000;  // four and more times the largest file of zones
constexpr std::size_t kMaxName = 64;         // bytes; the name appears in states and events
constexpr std::size_t kMaxQuoted = 240;      // bytes
constexpr double kMaxEdge_m = 100'000.0;
constexpr double kStraight_m = 1'000.0;
constexpr double kFar_m = 200'000.0;
constexpr double kMetresPerDeg = 111'195.0;  // of a great circle
constexpr double kMinSpeed_mps = 0.1;
constexpr double kMaxSpeed_mps = 30.0;

/// Why a file is rejected, without its name; empty: it is not.
using Fault = std::string;

/// Limits nesting and the number of values before they use memory.
Fault check_size(std::string_view text) {
  int depth = 0;
  std::size_t values = 0;
  bool in_string = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (in_string) {
      if (c == '\\') ++k;
      if (c == '"') in_string = false;
      continue;
    }
    if (c == '"') in_string = true;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (c == '[' || c == '{' || c == ',' || c == ':') ++values;
    if (depth > kMaxDepth) return fmt::format("is nested deeper than {} levels", kMaxDepth);
    if (values > kMaxValues) return fmt::format("has more than {} values", kMaxValues);
  }
  return "";
}

/// What a member is, for errors: its value if it is short.
std::string shown(const json& value) {
  if (value.is_structured()) return value.is_array() ? "an array" : "an object";
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  if (text.size() > kMaxName) text = text.substr(0, kMaxName) + "...";
  return printable(text);
}

/// Null: missing.
const json* member(const json& object, const char* key) {
  const auto it = object.find(key);
  return it == object.end() ? nullptr : &*it;
}

std::string missing_or(const json* value) {
  return value == nullptr ? std::string("is missing") : "is " + shown(*value);
}

class Reader {
 public:
  Fault read(const json& root);
  GeodeticZones take() { return std::move(out_); }

 private:
  Fault read_feature(const json& feature);
  Fault read_properties(const json& feature, Zone* zone);
  Fault read_geometry(const json& feature, Zone* zone);
  Fault read_polygon(const json& rings, const std::string& at, ZonePolygon* polygon);
  Fault read_ring(const json& positions, const std::string& at, ZoneRing* ring);
  Fault add_edge(const Vec2& to, std::size_t number, const std::string& at, ZoneRing* ring);

  GeodeticZones out_;
  std::size_t vertices_ = 0;
  std::size_t fences_ = 0;
};

Fault read_position(const json& position, Vec2* out) {
  if (!position.is_array() || position.size() < 2 || position.size() > 3) {
    return "is not [longitude, latitude] or [longitude, latitude, height]";
  }
  for (const json& number : position) {
    if (!number.is_number() || !std::isfinite(number.get<double>())) {
      return "has " + shown(number) + ", which is no finite number";
    }
  }
  *out = {position[0].get<double>(), position[1].get<double>()};
  if (std::abs(out->x()) > 180.0) {
    return fmt::format("has the longitude {}: allowed is -180 to 180 deg", out->x());
  }
  if (std::abs(out->y()) > 90.0) {
    return fmt::format(
        "has the latitude {}: allowed is -90 to 90 deg (positions are longitude, "
        "latitude)",
        out->y());
  }
  return "";
}

double length_m(const Vec2& from, const Vec2& to) {
  const double parallel = std::cos(radians(0.5 * (from.y() + to.y())));
  return kMetresPerDeg * std::hypot((to.x() - from.x()) * parallel, to.y() - from.y());
}

Fault Reader::read(const json& root) {
  if (!root.is_object()) return "is no GeoJSON object";
  const json* const type = member(root, "type");
  if (type == nullptr || *type != "FeatureCollection") {
    return "type: " + missing_or(type) + "; allowed is \"FeatureCollection\"";
  }
  if (const json* const crs = member(root, "crs"); crs != nullptr) {
    const json::json_pointer name("/properties/name");
    const std::string value = crs->contains(name) ? shown(crs->at(name)) : shown(*crs);
    if (value != "\"urn:ogc:def:crs:OGC:1.3:CRS84\"" && value != "\"urn:ogc:def:crs:OGC::CRS84\"") {
      return "crs: is " + value +
             "; allowed is urn:ogc:def:crs:OGC:1.3:CRS84 (WGS84, longitude before latitude), or no "
             "crs: export the layer with the CRS EPSG:4326";
    }
  }
  const json* const features = member(root, "features");
  if (features == nullptr || !features->is_array() || features->empty()) {
    return "features: must be an array of at least one feature";
  }
  for (std::size_t k = 0; k < features->size(); ++k) {
    const json& feature = (*features)[k];
    std::string name;
    if (feature.is_object() && feature.contains(json::json_pointer("/properties/name"))) {
      name = " " + shown(feature["properties"]["name"]);
    }
    if (const Fault fault = read_feature(feature); !fault.empty()) {
      return fmt::format("feature {}{}: {}", k + 1, name, fault);
    }
  }
  return "";
}

Fault Reader::read_feature(const json& feature) {
  if (!feature.is_object()) return "is no object";
  const json* const type = member(feature, "type");
  if (type == nullptr || *type != "Feature") {
    return "type: " + missing_or(type) + "; allowed is \"Feature\"";
  }
  if (member(feature, "crs") != nullptr) return "crs: is not allowed in a feature";
  Zone zone;
  if (Fault fault = read_properties(feature, &zone); !fault.empty()) return fault;
  if (Fault fault = read_geometry(feature, &zone); !fault.empty()) return fault;
  out_.zones.push_back(std::move(zone));
  return "";
}

Fault Reader::read_properties(const json& feature, Zone* zone) {
  const json* const properties = member(feature, "properties");
  if (properties == nullptr || !properties->is_object()) return "properties: is no object";
  const json* const kind = member(*properties, "kind");
  if (kind != nullptr && *kind == "fence") {
    zone->kind = ZoneKind::kFence;
  } else if (kind != nullptr && *kind == "keep_out") {
    zone->kind = ZoneKind::kKeepOut;
  } else if (kind != nullptr && *kind == "speed") {
    zone->kind = ZoneKind::kSpeed;
  } else if (kind != nullptr && *kind == "road") {
    zone->kind = ZoneKind::kRoad;
  } else {
    return "kind: " + missing_or(kind) +
           "; allowed are \"fence\", \"keep_out\", \"speed\", \"road\"";
  }
  const json* const name = member(*properties, "name");
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  if (name != nullptr && name->is_string()) zone->name = name->get<std::string>();
  if (zone->name.empty() || zone->name.size() > kMaxName ||
      std::any_of(zone->name.begin(), zone->name.end(), is_control) ||
      printable(zone->name) != zone->name) {
    return fmt::format("name: {}; allowed is text of 1 to {} bytes without control characters",
                       missing_or(name), kMaxName);
  }
  const json* const speed = member(*properties, "speed_mps");
  // QGIS writes null for an attribute that is not set.
  const bool has_speed = speed != nullptr && !speed->is_null();
  if (forbids(zone->kind)) {
    return has_speed
               ? "speed_mps: is " + shown(*speed) + "; allowed only with kind \"speed\" or \"road\""
               : "";
  }
  if (has_speed && speed->is_number()) zone->speed_mps = speed->get<double>();
  if (!(zone->speed_mps >= kMinSpeed_mps && zone->speed_mps <= kMaxSpeed_mps)) {
    return fmt::format("speed_mps: {}; allowed is {} to {} m/s", missing_or(speed), kMinSpeed_mps,
                       kMaxSpeed_mps);
  }
  return "";
}

Fault Reader::read_geometry(const json& feature, Zone* zone) {
  const json* const geometry = member(feature, "geometry");
  if (geometry == nullptr || !geometry->is_object()) return "geometry: is no object";
  if (member(*geometry, "crs") != nullptr) return "geometry: crs: is not allowed in a geometry";
  const json* const type = member(*geometry, "type");
  const bool several = type != nullptr && *type == "MultiPolygon";
  if (!several && (type == nullptr || *type != "Polygon")) {
    return "geometry: type: " + missing_or(type) + "; allowed are \"Polygon\", \"MultiPolygon\"";
  }
  const json* const coordinates = member(*geometry, "coordinates");
  if (coordinates == nullptr || !coordinates->is_array() || coordinates->empty()) {
    return "geometry: coordinates: must be an array that is not empty";
  }
  const std::size_t count = several ? coordinates->size() : 1;
  for (std::size_t k = 0; k < count; ++k) {
    ZonePolygon polygon;
    const std::string at =
        several ? fmt::format("coordinates: polygon {}: ", k + 1) : std::string("coordinates: ");
    if (Fault f = read_polygon(several ? (*coordinates)[k] : *coordinates, at, &polygon);
        !f.empty()) {
      return f;
    }
    zone->polygons.push_back(std::move(polygon));
  }
  fences_ += zone->kind == ZoneKind::kFence ? count : 0;
  if (fences_ > kMaxFencePolygons) {
    return fmt::format("is polygon {} of fences; allowed are {}", fences_, kMaxFencePolygons);
  }
  return "";
}

Fault Reader::read_polygon(const json& rings, const std::string& at, ZonePolygon* polygon) {
  if (!rings.is_array() || rings.empty()) return at + "must be an array of rings";
  for (std::size_t k = 0; k < rings.size(); ++k) {
    ZoneRing ring;
    if (Fault fault = read_ring(rings[k], fmt::format("{}ring {}: ", at, k + 1), &ring);
        !fault.empty()) {
      return fault;
    }
    if (k == 0) {
      polygon->outer = std::move(ring);
    } else {
      polygon->holes.push_back(std::move(ring));
    }
  }
  const std::optional<RingFault> fault = find_fault(*polygon);
  if (!fault) return "";
  const auto ring = [&](std::size_t k) -> const ZoneRing& {
    return k == 0 ? polygon->outer : polygon->holes[k - 1];
  };
  const Vec2& there = ring(fault->ring)[fault->edge];
  switch (fault->kind) {
    case RingFault::Kind::kOutside:
      return fmt::format("{}ring {}: is a hole that is not inside of ring 1", at, fault->ring + 1);
    case RingFault::Kind::kInOtherHole:
      return fmt::format("{}ring {}: is a hole inside of another hole, ring {}", at,
                         fault->ring + 1, fault->other_ring + 1);
    case RingFault::Kind::kCrossing:
      break;
  }
  const Vec2& other = ring(fault->other_ring)[fault->other_edge];
  return fmt::format(
      "{}ring {}: the edge from [{:.7f}, {:.7f}] crosses or touches the edge from [{:.7f}, {:.7f}] "
      "of ring {}; rings must not meet one another or themselves",
      at, fault->ring + 1, there.x(), there.y(), other.x(), other.y(), fault->other_ring + 1);
}

Fault Reader::read_ring(const json& positions, const std::string& at, ZoneRing* ring) {
  if (!positions.is_array() || positions.size() < 4) {
    return fmt::format("{}has {} positions; allowed are 4 and more, the last equal to the first",
                       at, positions.is_array() ? positions.size() : 0);
  }
  Vec2 first = Vec2::Zero();
  Vec2 last = Vec2::Zero();
  for (std::size_t k = 0; k < positions.size(); ++k) {
    Vec2 here;
    if (const Fault fault = read_position(positions[k], &here); !fault.empty()) {
      return fmt::format("{}position {}: {}", at, k + 1, fault);
    }
    if (k == 0) {
      first = here;
      ring->push_back(here);
      ++vertices_;
    } else if (here != last) {  // a position may be repeated: an edge of no length
      if (Fault fault = add_edge(here, k + 1, at, ring); !fault.empty()) return fault;
    }
    last = here;
  }
  if (last != first) {
    return fmt::format("{}is not closed: the last position is not equal to the first", at);
  }
  if (ring->size() > 1) ring->pop_back();  // the first one again
  if (ring->size() < 3) return at + "has fewer than 3 different positions";
  return "";
}

/// Adds a vertex, and others before it where the edge is long.
Fault Reader::add_edge(const Vec2& to, std::size_t number, const std::string& at, ZoneRing* ring) {
  const Vec2 from = ring->back();
  const double edge_m = length_m(from, to);
  if (edge_m > kMaxEdge_m) {
    return fmt::format(
        "{}position {}: is {:.0f} km from the one before; allowed are {:.0f} km (a zone that "
        "crosses the antimeridian is drawn as two polygons)",
        at, number, 1e-3 * edge_m, 1e-3 * kMaxEdge_m);
  }
  const int pieces = std::max(1, static_cast<int>(std::ceil(edge_m / kStraight_m)));
  vertices_ += static_cast<std::size_t>(pieces);
  if (vertices_ > kMaxZoneVertices) {
    return fmt::format(
        "{}position {}: the file has more than {} vertices, counting one for each "
        "kilometre of a long edge",
        at, number, kMaxZoneVertices);
  }
  for (int k = 1; k < pieces; ++k) {
    ring->push_back(from + (static_cast<double>(k) / pieces) * (to - from));
  }
  ring->push_back(to);
  return "";
}

}  // namespace

Zones GeodeticZones::in_world(const LocalFrame& world) const {
  std::vector<Zone> moved = zones;
  const auto project = [&](ZoneRing* ring) {
    for (Vec2& vertex : *ring) {
      const Vec3 p =
          world.to_world({radians(vertex.y()), radians(vertex.x()), world.datum().height});
      const double away_m = p.norm();
      Vec2 flat = p.head<2>();
      if (away_m > kFar_m) flat = flat.norm() > 0.0 ? flat.normalized() : Vec2(Vec2::UnitX());
      vertex = away_m > kFar_m ? Vec2(away_m * flat) : flat;
    }
  };
  for (Zone& zone : moved) {
    for (ZonePolygon& polygon : zone.polygons) {
      project(&polygon.outer);
      for (ZoneRing& hole : polygon.holes) project(&hole);
    }
  }
  return Zones(std::move(moved));
}

Result<GeodeticZones> parse_zones(std::string_view text, const std::string& file) {
  if (text.size() > kMaxZoneFileBytes) {
    return Error{fmt::format("{}: is larger than {} bytes", file, kMaxZoneFileBytes)};
  }
  if (const Fault fault = check_size(text); !fault.empty()) return Error{file + ": " + fault};
  json root;
  try {
    root = json::parse(text);
  } catch (const json::exception& e) {  // it does not leave this function
    // It quotes the file, and a token may be long.
    return Error{file + ": is no valid JSON: " +
                 printable(std::string_view(e.what()).substr(0, kMaxQuoted))};
  }
  Reader reader;
  if (const Fault fault = reader.read(root); !fault.empty()) return Error{file + ": " + fault};
  GeodeticZones zones = reader.take();
  zones.file = file;
  return zones;
}

Result<GeodeticZones> load_zones(const std::string& path) {
  if (Outcome checked = check_regular_file(path); !checked) return checked.error();
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{path + ": cannot open"};
  std::string text(kMaxZoneFileBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) return Error{path + ": cannot read"};
  text.resize(static_cast<std::size_t>(in.gcount()));
  return parse_zones(text, path);
}

}  // namespace rcs
