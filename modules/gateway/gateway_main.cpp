// Gateway: the only connection between the vehicle and off-board systems, by DDS.

#include "modules/gateway/gateway_node.h"
#include "rcs/node/process/node_main.h"

int main(int argc, char** argv) {
  return rcs::node_main(argc, argv, "gateway", rcs::gateway::make_gateway_node);
}
