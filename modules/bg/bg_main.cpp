// BG: behavior generation. Receives commands, the belief and the terrain, publishes drive commands.

#include "modules/bg/bg_node.h"
#include "rcs/node/process/node_main.h"

int main(int argc, char** argv) {
  return rcs::node_main(argc, argv, "bg", rcs::bg::make_live_bg_node);
}
