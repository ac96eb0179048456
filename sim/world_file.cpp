#include "sim/world_file.h"

#include <utility>

namespace rcs::sim {
namespace {

void read_features(ParamTable* world, std::vector<Feature>* features) {
  if (world->has("feature")) features->clear();
  for (ParamTable table : world->tables("feature")) {
    Feature f;
    std::string kind = "step";
    table.get(
        "kind", &kind, {"step", "ditch", "wall"},
        "Feature of the ground along a line. Step: the ground on its left is higher, or lower, "
        "by height_m.");
    f.kind = kind == "step"    ? Feature::Kind::kStep
             : kind == "ditch" ? Feature::Kind::kDitch
                               : Feature::Kind::kWall;
    table.get("x1_m", &f.a_world.x(), {-5000, 5000}, "East coordinate of the beginning.");
    table.get("y1_m", &f.a_world.y(), {-5000, 5000}, "North coordinate of the beginning.");
    table.get("x2_m", &f.b_world.x(), {-5000, 5000}, "East coordinate of the end.");
    table.get("y2_m", &f.b_world.y(), {-5000, 5000}, "North coordinate of the end.");
    table.get("height_m", &f.height_m, {-20, 20},
              "Height of a step (negative: a drop) or a wall, depth of a ditch.");
    table.get("width_m", &f.width_m, {0, 50},
              "Horizontal length of a step's slope, width of a ditch, thickness of a wall.");
    table.get("extent_m", &f.extent_m, {0, 500},
              "Level ground beyond a step, before it returns gently to the height of the relief.");
    if ((f.b_world - f.a_world).norm() < 0.1) table.fail("x2_m", "the line has no length");
    if (f.kind != Feature::Kind::kStep && f.height_m < 0.0) {
      table.fail("height_m", "of a ditch or a wall must not be negative");
    }
    features->push_back(f);
  }
}

void read_roads(ParamTable* world, std::vector<Road>* roads) {
  if (world->has("road")) roads->clear();
  for (ParamTable table : world->tables("road")) {
    Road road;
    table.get("width_m", &road.width_m, {1, 1000},
              "Width of a road, or of a plain. On it the relief has no octaves finer than "
              "finest_m, and nothing grows.");
    table.get("finest_m", &road.finest_m, {0, 5000},
              "Spacing of the finest octave of the relief that remains on a road.");
    table.get("shoulder_m", &road.shoulder_m, {0, 200},
              "Width on each side of a road over which the ground passes into the relief.");
    read_line(&table, "point", &road.points_world);
    if (road.points_world.size() < 2) table.fail("point", "at least two are needed");
    roads->push_back(std::move(road));
  }
}

}  // namespace

void read_line(ParamTable* table, const char* key, std::vector<Vec2>* places_world) {
  for (ParamTable place : table->tables(key)) {
    Vec2 p = Vec2::Zero();
    place.get("x_m", &p.x(), {-5000, 5000}, "East coordinate of a place in frame world.");
    place.get("y_m", &p.y(), {-5000, 5000}, "North coordinate of a place in frame world.");
    places_world->push_back(p);
  }
  for (std::size_t k = places_world->size(); k-- > 1;) {
    if (((*places_world)[k] - (*places_world)[k - 1]).norm() >= 1.0) continue;
    table->fail(key, "number " + std::to_string(k + 1) + " is within 1 m of the one before");
  }
}

void read_world(ParamTable table, WorldParams* world, bool* seed_follows, std::string* dem,
                Geodetic* datum) {
  std::int64_t seed = static_cast<std::int64_t>(world->seed);
  table.get("seed", &seed, {0, 1e15},
            "Seed of the world: relief, rocks and vegetation. The scenario's seed replaces it "
            "where seed_follows is true.");
  world->seed = static_cast<std::uint64_t>(seed);
  table.get("seed_follows", seed_follows,
            "Makes the world by the scenario's seed, so that every seed is another terrain.");
  table.get("dem", dem,
            "ESRI ASCII grid of the ground, relative to this file; the relief of the octaves is "
            "added. Empty: octaves alone.");
  table.get_deg("datum_lat_deg", &datum->lat_rad, {-90, 90},
                "Latitude of the origin of frame world.");
  table.get_deg("datum_lon_deg", &datum->lon_rad, {-180, 180},
                "Longitude of the origin of frame world.");
  table.get("datum_height_m", &datum->height.m, {-1000, 9000},
            "Ellipsoidal height of the origin of frame world.");
  table.get("clear_m", &world->clear_m, {0, 20},
            "Distance from the course (commanded: from the start and the waypoints) within which "
            "no rock or plant is placed.");
  table.get("reach_m", &world->reach_m, {0, 2000},
            "Extent of the world around the rectangle of the course, beyond the range of the "
            "LADAR; the vehicle stops at its border. 0: 20 m, and 40 m for a commanded drive.");
  if (table.has("octave")) world->octaves.clear();
  for (ParamTable octave : table.tables("octave")) {
    Octave o;
    octave.get(
        "spacing_m", &o.spacing_m, {0.1, 5000},
        "Lattice spacing of an octave of the relief; its hills are about three spacings apart.");
    octave.get("rms_m", &o.rms_m, {0, 500},
               "Root mean square of the height of an octave of the relief.");
    world->octaves.push_back(o);
  }
  read_features(&table, &world->features);
  read_roads(&table, &world->roads);
  ParamTable rocks = table.table("rocks");
  rocks.get("per_m2", &world->rocks.per_m2, {0, 1}, "Mean number of rocks per square metre.");
  rocks.get("radius_min_m", &world->rocks.radius_min_m, {0.05, 2},
            "Smallest radius of a rock; small rocks are more frequent.");
  rocks.get("radius_max_m", &world->rocks.radius_max_m, {0.05, 2}, "Largest radius of a rock.");
  VegetationParams& v = world->vegetation;
  ParamTable vegetation = table.table("vegetation");
  vegetation.get("patch_m", &v.patch_m, {1, 500},
                 "Size of the patches in which thickets and meadows alternate.");
  vegetation.get("bushes_per_m2", &v.bushes_per_m2, {0, 1},
                 "Mean number of bushes per square metre; there are none in meadows.");
  vegetation.get("trees_per_m2", &v.trees_per_m2, {0, 1},
                 "Mean number of trees per square metre; there are none in meadows.");
  vegetation.get("transmittance_per_m", &v.transmittance_per_m, {0.001, 0.999},
                 "Share of the light that foliage transmits per metre. Larger: the LADAR sees "
                 "deeper into it.");
  vegetation.get("sway_m", &v.sway_m, {0, 0.5},
                 "Amplitude of the sway of tree crowns; bushes sway 0.3 of it.");
  vegetation.get("sway_hz", &v.sway_hz, {0, 5}, "Frequency of the sway of vegetation.");
  vegetation.get("grass_height_m", &v.grass_height_m, {0, 1},
                 "Height of the grass in meadows; 0: no grass.");
  vegetation.get(
      "grass_transmittance_per_m", &v.grass_transmittance_per_m, {0.001, 0.999},
      "Share of the light that grass transmits per metre. Larger: the LADAR sees deeper into it.");
}

}  // namespace rcs::sim
