// BG: behavior generation. Receives commands, the belief and the terrain, publishes drive commands.

#include "modules/bg/bg_node.h"
#include "rcs/node/process/node_main.h"
#include "rcs/node/stop_latch.h"

namespace rcs::bg {
namespace {

/// For --check, which may run as another user than the vehicle: the latch is not opened, because
/// that creates its folder. A configuration without a folder is invalid.
Result<std::unique_ptr<Node>> make_checked_bg_node(const ParamFile& file, Bus* bus) {
  const Result<std::string> latch = stop_latch_path(file);
  if (!latch) return latch.error();
  return make_bg_node(file, bus);
}

}  // namespace
}  // namespace rcs::bg

int main(int argc, char** argv) {
  return rcs::node_main(argc, argv, "bg", rcs::bg::make_live_bg_node,
                        rcs::bg::make_checked_bg_node);
}
