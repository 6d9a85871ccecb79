#include "node_main.h"
#include "ros/operator/operator_menu.h"

namespace {
constexpr ttsdf::NodeHelp kHelp{
    "operator_menu_node", "",
    R"(A ball above the robot in rviz with the localizer's state written above it; a right click on it opens a menu:
global localization, search near the last pose, pause, forget the pose, load and build maps.

subscribes  status, pose
publishes   operator/text, operator/update, operator/update_full
calls       ~global_localization, ~relocalize, ~pause, ~reset and ~load_map of the localizer, ~build_map of the
            map builder
)",
    "localization.launch operator_menu:=true"};
}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runNode(argc, argv, "operator_menu", kHelp,
                        [](const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
                          return ttsdf::OperatorMenu(node, private_node);
                        });
}
