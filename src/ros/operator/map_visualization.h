#pragma once
// What rviz shows of a map. On the builder's side only: the robot's process needs none of it.

#include <ros/time.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/Marker.h>

#include <string>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

/// Throws std::runtime_error if the map has too many voxels to be decompressed for a picture.
void requireShowable(const TtSdfMap& map);

/// TRIANGLE_LIST, coloured by the direction a triangle faces so that shapes show without lighting. An empty
/// mesh gives a marker with action DELETE: the surface shown before goes away. At most `max_triangles`: a
/// larger mesh is thinned by joining vertices on a coarser and coarser lattice.
visualization_msgs::Marker surfaceMarker(const SurfaceMesh& mesh, int max_triangles,
                                         const std::string& frame_id, const ros::Time& stamp);

/// Joins the vertices in each cube of `cell` [m] into one and drops triangles that collapse.
SurfaceMesh clusterVertices(const SurfaceMesh& mesh, double cell);

/// Coloured cloud (x, y, z, rgb) of the field on the plane z = height [m] of the map frame, one point per
/// `spacing` [m]: red in free space, blue behind surfaces, white at the surface, deeper with distance up to
/// `range` [m]; dark grey where the map knows nothing.
sensor_msgs::PointCloud2 sliceCloud(const DistanceField& field, double height, double spacing, double range,
                                    const std::string& frame_id, const ros::Time& stamp);

}  // namespace ttsdf
