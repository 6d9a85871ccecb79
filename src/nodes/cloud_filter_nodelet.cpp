// Clouds of a depth camera without its usual rubbish: range, thinning and stray points in one step. PCL's
// filters in pcl_ros's nodelet. (Debian's description of pcl_ros names a library that does not exist:
// pcl/VoxelGrid and its like cannot be loaded there.)

#include <nodelet/nodelet.h>
#include <pcl/filters/passthrough.h>
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/filters/filter.h>

#include <exception>
#include <pluginlib/class_list_macros.hpp>

#include "ros/parameters/parameters.h"

namespace ttsdf_localization {

struct CloudFilterOptions {
  double min_depth = 0.3, max_depth = 5.0, leaf_size = 0.03, radius = 0.1;
  int min_neighbors = 3;
};

const ttsdf::OptionTable<CloudFilterOptions>& cloudFilterOptionTable() {
  using Options = CloudFilterOptions;
  static const auto table =
      ttsdf::OptionTable<Options>()
          .add("min_depth", &Options::min_depth, 0.0, 1e3, "m", "Along the camera's z axis.")
          .add("max_depth", &Options::max_depth, 0.0, 1e3, "m", "Along the camera's z axis.")
          .add("leaf_size", &Options::leaf_size, 0.0, 10.0, "m", "One point is kept per cube; 0: all.")
          .add("radius", &Options::radius, 0.0, 10.0, "m",
               "Within which a point needs its neighbours; 0: none.")
          .add("min_neighbors", &Options::min_neighbors, 1, 1000, "", "So many, or the point is dropped.");
  return table;
}

class CloudFilterNodelet : public pcl_ros::Filter {
 private:
  bool child_init(ros::NodeHandle& private_nh, bool& has_service) override {
    has_service = true;  // its own parameters, not those of pcl_ros
    try {
      ttsdf::ParameterSet parameters;
      parameters.add("", options_, cloudFilterOptionTable());
      for (const char* key : {"max_queue_size", "use_indices", "latched_indices", "approximate_sync"})
        parameters.ignore(key);
      parameters.load(private_nh);
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM("Cloud filter not started: " << error.what());
      return false;
    }
    return true;
  }

  void filter(const PointCloud2::ConstPtr& input, const IndicesPtr& /*indices*/,
              PointCloud2& output) override {
    pcl::PCLPointCloud2::Ptr cloud(new pcl::PCLPointCloud2);
    try {
      pcl_conversions::toPCL(*input, *cloud);
      pcl::PassThrough<pcl::PCLPointCloud2> range;
      range.setFilterFieldName("z");
      range.setFilterLimits(options_.min_depth, options_.max_depth);
      apply(range, cloud);
      if (options_.leaf_size > 0.0) {
        pcl::VoxelGrid<pcl::PCLPointCloud2> thinning;
        const auto leaf = static_cast<float>(options_.leaf_size);
        thinning.setLeafSize(leaf, leaf, leaf);
        apply(thinning, cloud);
      }
      if (options_.radius > 0.0) {
        pcl::RadiusOutlierRemoval<pcl::PCLPointCloud2> stray;
        stray.setRadiusSearch(options_.radius);
        stray.setMinNeighborsInRadius(options_.min_neighbors);
        apply(stray, cloud);
      }
    } catch (const std::exception& error) {
      NODELET_ERROR_STREAM_THROTTLE(5.0, "a cloud was not filtered: " << error.what());
      *cloud = pcl::PCLPointCloud2();
    }
    pcl_conversions::moveFromPCL(*cloud, output);
    output.header = input->header;
  }

  template <class Filter>
  static void apply(Filter& filter, pcl::PCLPointCloud2::Ptr& cloud) {
    if (cloud->width * cloud->height == 0) return;
    pcl::PCLPointCloud2::Ptr kept(new pcl::PCLPointCloud2);
    filter.setInputCloud(cloud);
    filter.filter(*kept);
    cloud = kept;
  }

  CloudFilterOptions options_;
};

}  // namespace ttsdf_localization

PLUGINLIB_EXPORT_CLASS(ttsdf_localization::CloudFilterNodelet, nodelet::Nodelet)
