#include "ros/maps/map_source.h"

#include <ros/connection.h>
#include <ros/service.h>
#include <ros/service_manager.h>

#include <exception>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "ros/messages/conversions.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

LoadedMap prepareMap(const std::vector<std::uint8_t>& bytes, const MapSourceOptions& options,
                     const RegistrationOptions& registration) {
  const MapFileInfo info = fileInfo(bytes.data(), bytes.size());
  const TtSdfMap map =
      deserialize(bytes.data(), bytes.size(), {options.max_map_megabytes, options.max_map_voxels});
  TtFieldOptions field_options;
  field_options.memory_megabytes = options.memory_megabytes;
  LoadedMap loaded;
  loaded.map = Localizer::prepare(makeField(map, field_options), registration);
  loaded.map_id = info.map_id;
  loaded.frame_id = map.frame_id;
  loaded.message = toMapMessage(map, bytes, map.frame_id);
  std::ostringstream text;
  text << "map " << info.map_id << ": " << map.geometry.dims.transpose() << " voxels of "
       << map.geometry.voxel_size << " m, ranks " << map.train.rank1() << ' ' << map.train.rank2() << ", "
       << info.file_bytes << " bytes (" << name(info.encoding) << "), " << loaded.map.field->memoryBytes()
       << " bytes in memory";
  loaded.summary = text.str();
  return loaded;
}

LoadedMap prepareMapFile(const std::string& path, const MapSourceOptions& options,
                         const RegistrationOptions& registration) {
  try {
    return prepareMap(readFile(path), options, registration);
  } catch (const MapFormatError& error) {
    throw std::runtime_error("map file '" + path + "': " + error.what());
  } catch (const std::runtime_error& error) {
    if (path.empty() || path.front() == '/') throw;
    throw std::runtime_error(error.what() + std::string("; a relative path, looked up in '") +
                             std::filesystem::current_path().string() + "', wanted an absolute one");
  }
}

MapSource::MapSource(ros::NodeHandle& node, const MapSourceOptions& options,
                     const RegistrationOptions& registration, LoadedCallback loaded, FailedCallback failed)
    : options_(options),
      registration_(registration),
      loaded_(std::move(loaded)),
      failed_(std::move(failed)),
      node_(node) {
  thread_ = std::thread(&MapSource::run, this);
  if (options_.map_source == "topic") {
    subscriber_ = node_.subscribe("ttsdf_map", 1, &MapSource::onMap, this);
  } else if (options_.map_source == "file" && !options_.map_file.empty()) {
    put([this] { return prepareFile(options_.map_file); });
  }
}

MapSource::~MapSource() {
  stop_ = true;
  subscriber_.shutdown();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (link_) link_->getConnection()->drop(ros::Connection::Destructing);  // ends a call that hangs
  }
  jobs_.close();
  thread_.join();
}

void MapSource::put(Job job) { jobs_.put(std::move(job)); }

void MapSource::onMap(const ttsdf_localization::TtSdfMapConstPtr& message) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!message->map_id.empty() && message->map_id == last_topic_id_) return;
  }
  put([this, message] {
    LoadedMap map = prepare(message->data);
    const std::lock_guard<std::mutex> lock(mutex_);
    last_topic_id_ = message->map_id;  // only now: a bad one may come again whole
    return map;
  });
}

ttsdf_localization::GetMap::Response MapSource::callOnce(const std::string& service) {
  // Not ros::service::call: nothing could end that while the other side hangs, and a nodelet must unload.
  ttsdf_localization::GetMap call;
  ros::ServiceServerLinkPtr link = ros::ServiceManager::instance()->createServiceServerLink(
      service, true, ros::service_traits::md5sum(call), ros::service_traits::md5sum(call), {});
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!link || stop_) throw std::runtime_error("could not be called");
    link_ = link;
  }
  ros::SerializedMessage reply;
  const bool answered = link->call(ros::serialization::serializeMessage(call.request), reply);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    link_.reset();
    link->getConnection()->drop(ros::Connection::Destructing);
  }
  if (!answered) throw std::runtime_error("did not answer");
  try {
    ros::serialization::deserializeMessage(reply, call.response);
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("sent a damaged answer: ") + error.what());
  }
  return call.response;
}

LoadedMap MapSource::mapOfService(const std::string& service) {
  const ttsdf_localization::GetMap::Response response = callOnce(service);
  if (!response.success) throw std::runtime_error(response.message);
  try {
    return prepare(response.map.data);
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("sent a map that cannot be used: ") + error.what());
  }
}

void MapSource::callService() {
  // The service may come up much later, and the node may be asked to stop meanwhile. Whatever goes wrong is
  // said, and the service is called again: whoever answers may mend it.
  const std::string service = node_.resolveName("get_map");
  while (!stop_ && ros::ok()) {
    if (!ros::service::exists(service, false)) {
      ros::WallDuration(0.1).sleep();  // not waitForService: it counts in a clock that may stand still
      continue;
    }
    try {
      loaded_(mapOfService(service));
      return;
    } catch (const std::exception& error) {
      if (stop_) return;
      failed_("service '" + service + "': " + error.what() + "; it is called again");
    }
    for (int n = 0; n < 10 && !stop_; ++n) ros::WallDuration(0.1).sleep();
  }
}

void MapSource::run() {
  if (options_.map_source == "service") callService();
  while (const auto job = jobs_.take()) {
    try {
      loaded_((*job)());
    } catch (const std::exception& error) {
      failed_(error.what());
    }
  }
}

}  // namespace ttsdf
