// Gateway: everything off-board speaks to the vehicle here, by DDS, and nowhere else.

#include "modules/gateway/gateway_node.h"
#include "rcs/node/process/node_main.h"

int main(int argc, char** argv) {
  return rcs::node_main(argc, argv, "gateway", rcs::gateway::make_gateway_node);
}
