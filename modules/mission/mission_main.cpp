// The vehicle level: turns tasks into routes, and commands BG.

#include "modules/mission/mission_node.h"
#include "rcs/node/process/node_main.h"

int main(int argc, char** argv) {
  return rcs::node_main(argc, argv, "mission", rcs::mission::make_mission_node);
}
