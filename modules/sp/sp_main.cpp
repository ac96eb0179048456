// SP: sensory processing. LADAR facets in, registrations out.

#include "modules/sp/sp_node.h"
#include "rcs/node/process/node_main.h"

int main(int argc, char** argv) {
  return rcs::node_main(argc, argv, "sp", rcs::sp::make_live_sp_node);
}
