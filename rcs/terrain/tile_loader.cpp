#include "rcs/terrain/tile_loader.h"

#include "rcs/base/byte_codec.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"

namespace rcs {

void load_tile(const std::string& map, std::vector<std::uint8_t>* buffer, TileJob* job) {
  job->failure.clear();
  const std::string file = tile_file(map, job->cell_m, job->tile);
  if (Outcome read = read_file(file, kMaxTileBytes, buffer); !read) {
    job->failure = read.error().message;
    return;
  }
  // A tile that somebody has changed may be sound and wrong.
  if (crc32(buffer->data(), buffer->size()) != job->checksum) {
    job->failure = file + ": is not the file of the map's index (its checksum differs)";
    return;
  }
  const Result<Raster> tile = decode_tile(buffer->data(), buffer->size(), job->lattice);
  if (!tile) {
    job->failure = file + ": " + tile.error().message;
    return;
  }
  if (!(tile_of(tile->first) == job->tile)) {
    job->failure = file + ": contains another tile than its name states";
    return;
  }
  if (tile->points.size() > job->max_points) {
    job->failure = file + ": has " + std::to_string(tile->points.size()) +
                   " surface points, the map's index allows " + std::to_string(job->max_points);
    return;
  }
  for (std::size_t k = 0; k < kTileCells; ++k) {
    job->nodes[k] = {tile->z_m[k], layer_at(tile->sigma_m, k)};
  }
  if (job->points != nullptr) job->points->load(tile->points);
}

bool DirectTileLoader::start(const TileJob& job) {
  if (done_) return false;
  job_ = job;
  load_tile(map_, &buffer_, &job_);
  done_ = true;
  return true;
}

bool DirectTileLoader::finished(TileJob* job) {
  if (!done_) return false;
  *job = job_;
  done_ = false;
  return true;
}

}  // namespace rcs
