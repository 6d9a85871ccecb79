// pcl_ros's filters as nodelets of a library that links them: Debian's description of pcl_ros names a library
// where there is none, so that pcl/VoxelGrid and its like cannot be loaded there.

#include <nodelet/nodelet.h>
#include <pcl_ros/filters/passthrough.h>
#include <pcl_ros/filters/radius_outlier_removal.h>
#include <pcl_ros/filters/voxel_grid.h>

#include <pluginlib/class_list_macros.hpp>

namespace ttsdf_localization {

class PassThrough : public pcl_ros::PassThrough {};
class VoxelGrid : public pcl_ros::VoxelGrid {};
class RadiusOutlierRemoval : public pcl_ros::RadiusOutlierRemoval {};

}  // namespace ttsdf_localization

PLUGINLIB_EXPORT_CLASS(ttsdf_localization::PassThrough, nodelet::Nodelet)
PLUGINLIB_EXPORT_CLASS(ttsdf_localization::VoxelGrid, nodelet::Nodelet)
PLUGINLIB_EXPORT_CLASS(ttsdf_localization::RadiusOutlierRemoval, nodelet::Nodelet)
