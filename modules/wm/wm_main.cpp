// WM: world modelling. Receives sensor data and registrations, publishes the belief.

#include "modules/wm/wm_node.h"
#include "rcs/node/process/node_main.h"

int main(int argc, char** argv) {
  return rcs::node_main(argc, argv, "wm", rcs::wm::make_live_wm_node);
}
