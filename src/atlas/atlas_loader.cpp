#include "ttsdf_localization/atlas/atlas_loader.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "freed_memory.h"
#include "map_ranking.h"
#include "map_shelf.h"

namespace ttsdf {

namespace {

constexpr double kSight = 15.0;  // [m] scans do not reach into maps that are further from those in use
constexpr double kStays = 1.25;  // a map in use is wanted a little longer: no coming and going at the border

std::size_t toBytes(double megabytes) { return static_cast<std::size_t>(megabytes * 1048576.0); }

}  // namespace

void check(const AtlasLoaderOptions& options) {
  const auto positive = [](const char* name, double value) {
    if (std::isfinite(value) && value > 0.0) return;
    throw std::invalid_argument(std::string("atlas loader: ") + name + ": got " + std::to_string(value) +
                                ", wanted a number above 0");
  };
  positive("memory_megabytes", options.memory_megabytes);
  positive("map_megabytes", options.map_megabytes);
  positive("radius", options.radius);
  positive("retry_seconds", options.retry_seconds);
  if (!std::isfinite(options.prediction) || options.prediction < 0.0) {
    throw std::invalid_argument("atlas loader: prediction: got " + std::to_string(options.prediction) +
                                ", wanted 0 or more");
  }
}

class AtlasLoader::Impl {
  /// An edition of the atlas, ready to be asked.
  struct Edition {
    explicit Edition(Atlas a) : atlas(std::move(a)), ranking((check(atlas), atlas)) {}
    Atlas atlas;
    MapRanking ranking;
  };

  struct Failure {
    std::string map_id, message;
    std::chrono::steady_clock::time_point again;
  };

 public:
  Impl(MapBytes files, Atlas atlas, const AtlasLoaderOptions& options, Changed changed)
      : files_(std::move(files)),
        options_((check(options), options)),
        changed_(std::move(changed)),
        edition_(std::make_shared<const Edition>(std::move(atlas))),
        budget_(toBytes(options_.memory_megabytes)) {
    thread_ = std::thread(&Impl::run, this);
  }

  ~Impl() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stop_ = true;
    }
    asked_.notify_all();
    thread_.join();
  }

  void want(const RobotMotion& motion) {
    if (!motion.position.allFinite()) return;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      motion_ = motion;
      ++serial_;
    }
    asked_.notify_all();
  }

  void setAtlas(Atlas atlas) {
    auto edition = std::make_shared<const Edition>(std::move(atlas));
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      edition_ = std::move(edition);
      forget_failures_ = true;
      ++serial_;
    }
    asked_.notify_all();
  }

  std::shared_ptr<const AtlasField> field() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return field_;
  }
  AtlasLoaderStatus status() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return status_;
  }
  bool waitUntilSettled(double seconds) const {
    std::unique_lock<std::mutex> lock(mutex_);
    return settled_.wait_for(lock, std::chrono::duration<double>(seconds),
                             [this] { return settled_serial_ == serial_; });
  }

 private:
  /// What the thread works on; everything below is the thread's own but what the lock guards.
  struct Task {
    std::shared_ptr<const Edition> edition;
    RobotMotion motion;
    bool motion_known;
    std::uint64_t serial;
  };
  struct Plan {
    std::vector<std::size_t> chosen;  ///< wanted maps within the budget, the most useful first
    std::size_t over_budget = 0;
  };

  std::optional<Task> nextTask() {
    std::unique_lock<std::mutex> lock(mutex_);
    const auto due = [this] { return stop_ || serial_ != settled_serial_; };
    const auto retry = nextRetry();
    if (retry) {
      asked_.wait_until(lock, *retry, due);
    } else {
      asked_.wait(lock, due);
    }
    if (stop_) return std::nullopt;
    if (forget_failures_) failures_.clear();
    forget_failures_ = false;
    return Task{edition_, motion_.value_or(RobotMotion()), motion_.has_value(), serial_};
  }

  void run() {
    while (const auto task = nextTask()) {
      if (task->motion_known) serve(*task);
      settle(task->serial);
    }
  }

  /// Loads one map after the other until all is there, or something else is asked for.
  void serve(const Task& task) {
    if (edition_followed_ != task.edition) {
      shelf_.follow(task.edition->atlas);
      forgetReplaced(task.edition->atlas);
      edition_followed_ = task.edition;
    }
    forgetOldFailures();
    while (!newer(task.serial)) {
      const Plan plan = choose(task);
      const auto next = nextToLoad(task, plan);
      if (next && !roomFor(task, plan, *next)) {
        fail(task.edition->atlas.maps[*next], "no memory is left for it");
        continue;
      }
      publish(task, plan);  // before the load: what was dropped is to be let go
      if (!next) return;
      load(task, *next);
    }
  }

  Plan choose(const Task& task) {
    const MapRanking& ranking = task.edition->ranking;
    Plan plan;
    std::size_t sum = 0;
    for (const auto& entry : ranking.near(task.motion, options_.prediction, kStays * options_.radius)) {
      const AtlasMap& map = task.edition->atlas.maps[entry.map];
      if (entry.distance > options_.radius && used_.count(map.name) == 0) continue;
      if (failing(map) && !shelf_.has(map.name)) continue;
      const std::size_t bytes = shelf_.expected(map, toBytes(options_.map_megabytes));
      if (sum + bytes > budget_) {
        ++plan.over_budget;
        continue;
      }
      sum += bytes;
      plan.chosen.push_back(entry.map);
    }
    for (auto it = plan.chosen.rbegin(); it != plan.chosen.rend(); ++it)
      shelf_.touch(task.edition->atlas.maps[*it].name);
    return plan;
  }

  std::optional<std::size_t> nextToLoad(const Task& task, const Plan& plan) const {
    for (const std::size_t n : plan.chosen) {
      const AtlasMap& map = task.edition->atlas.maps[n];
      if (!shelf_.hasEdition(map) && !failing(map)) return n;
    }
    return std::nullopt;
  }

  bool roomFor(const Task& task, const Plan& plan, std::size_t next) {
    std::set<std::string> keep;
    for (const std::size_t n : plan.chosen) keep.insert(task.edition->atlas.maps[n].name);
    const AtlasMap& map = task.edition->atlas.maps[next];
    const std::size_t bytes = shelf_.expected(map, toBytes(options_.map_megabytes));
    if (shelf_.makeRoom(bytes, budget_, keep)) return true;
    if (!shelf_.has(map.name)) return false;
    shelf_.drop(map.name);  // the old edition makes room for the new one
    return shelf_.makeRoom(bytes, budget_, keep);
  }

  void load(const Task& task, std::size_t n) {
    const AtlasMap& map = task.edition->atlas.maps[n];
    std::uint64_t seen = task.serial;
    const KeepGoing keep_going = [&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (stop_) return false;
      if (serial_ == seen) return true;
      seen = serial_;
      return edition_ == task.edition &&
             task.edition->ranking.distance(n, *motion_, options_.prediction) <= kStays * options_.radius;
    };
    try {
      PlacedField placed =
          loadPlaced(files_, map, options_.map_megabytes, options_.long_range, options_.limits, keep_going);
      failures_.erase(map.name);
      useless_.erase(map.name);
      shelf_.put(std::move(placed));
      const std::size_t bytes = shelf_.expected(map, 0);
      if (bytes > budget_) {
        shelf_.drop(map.name);
        fail(map, "takes " + std::to_string(bytes) + " bytes of memory, wanted at most " +
                      std::to_string(budget_) + " (memory_megabytes)");
      }
      shelf_.makeRoom(0, budget_, {map.name});  // it may be larger than was expected
      releaseFreedMemory();                     // what loading took, and what was dropped for it
    } catch (const Cancelled&) {
    } catch (const MapFormatError& error) {
      useless_[map.name] = map.map_id;
      fail(map, error.what());
    } catch (const std::exception& error) {
      fail(map, error.what());
    }
  }

  void publish(const Task& task, const Plan& plan) {
    std::vector<PlacedField> maps;
    std::vector<std::size_t> used;
    std::vector<std::pair<std::string, std::string>> editions;
    AtlasLoaderStatus status;
    bool inside = false, coming = false;
    for (const std::size_t n : plan.chosen) {
      const AtlasMap& map = task.edition->atlas.maps[n];
      const bool holds = task.edition->ranking.holds(n, task.motion.position);
      if (!shelf_.hasEdition(map) && !failing(map)) {
        status.waiting.push_back(map.name);
        coming = coming || holds;
      }
      if (!shelf_.has(map.name)) continue;
      inside = inside || holds;
      used.push_back(n);
      maps.push_back(shelf_.get(map.name));
      editions.emplace_back(map.name, maps.back().map_id);
      status.in_use.push_back(map.name);
    }
    std::sort(editions.begin(), editions.end());
    status.behind = coming && !inside;
    status.over_budget = plan.over_budget;
    status.loaded = shelf_.size();
    status.bytes = shelf_.bytes();
    for (const auto& [name, failure] : failures_) status.failed[name] = failure.message;
    used_.clear();
    used_.insert(status.in_use.begin(), status.in_use.end());
    const bool changed =
        editions != used_editions_ || edition_used_ != task.edition || used_useless_ != useless_;
    std::shared_ptr<const AtlasField> field, before;
    if (changed && !maps.empty())
      field = std::make_shared<const AtlasField>(std::move(maps), absentAround(task, used));
    {
      // What was there goes after the lock: letting maps go takes milliseconds, and want() comes from the
      // scans.
      const std::lock_guard<std::mutex> lock(mutex_);
      std::swap(status_, status);
      if (changed) before = std::exchange(field_, field);
    }
    const bool first_nothing = changed && editions.empty() && used_editions_.empty();
    used_editions_ = std::move(editions);
    edition_used_ = task.edition;
    used_useless_ = useless_;
    if (changed && !first_nothing && changed_) changed_(field);
  }

  /// Boxes of the maps that a scan may reach into and that are not in use. Without those whose files are no
  /// maps: they will not come, and the robot would not be tracked around them.
  std::vector<OrientedBox> absentAround(const Task& task, const std::vector<std::size_t>& used) const {
    std::vector<OrientedBox> boxes;
    for (const std::size_t n : task.edition->ranking.around(used, kSight)) {
      const AtlasMap& map = task.edition->atlas.maps[n];
      if (useless_.count(map.name) == 0) boxes.push_back(map.box());
    }
    return boxes;
  }

  bool failing(const AtlasMap& map) const {
    const auto found = failures_.find(map.name);
    return found != failures_.end() && found->second.map_id == map.map_id &&
           std::chrono::steady_clock::now() < found->second.again;
  }
  void fail(const AtlasMap& map, const std::string& message) {
    const auto after = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(options_.retry_seconds));
    failures_[map.name] = {map.map_id, message, std::chrono::steady_clock::now() + after};
  }
  /// Another file may be a map.
  void forgetReplaced(const Atlas& atlas) {
    for (auto it = useless_.begin(); it != useless_.end();) {
      const AtlasMap* const map = atlas.find(it->first);
      it = map && map->map_id == it->second ? std::next(it) : useless_.erase(it);
    }
  }
  /// Their time has come: they are tried again if they are still wanted.
  void forgetOldFailures() {
    const auto now = std::chrono::steady_clock::now();
    for (auto it = failures_.begin(); it != failures_.end();) {
      it = it->second.again <= now ? failures_.erase(it) : std::next(it);
    }
  }
  std::optional<std::chrono::steady_clock::time_point> nextRetry() const {
    std::optional<std::chrono::steady_clock::time_point> first;
    for (const auto& [name, failure] : failures_) {
      if (!first || failure.again < *first) first = failure.again;
    }
    return first;
  }

  bool newer(std::uint64_t serial) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return stop_ || serial_ != serial;
  }
  void settle(std::uint64_t serial) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (serial_ == serial) settled_serial_ = serial;
    }
    settled_.notify_all();
  }

  const MapBytes files_;
  const AtlasLoaderOptions options_;
  const Changed changed_;

  mutable std::mutex mutex_;
  std::condition_variable asked_;
  mutable std::condition_variable settled_;
  std::shared_ptr<const Edition> edition_;
  std::optional<RobotMotion> motion_;
  std::uint64_t serial_ = 0, settled_serial_ = 0;
  bool stop_ = false, forget_failures_ = false;
  std::shared_ptr<const AtlasField> field_;
  AtlasLoaderStatus status_;

  // The thread's own.
  const std::size_t budget_;
  MapShelf shelf_;
  std::map<std::string, Failure> failures_;
  std::map<std::string, std::string> useless_, used_useless_;  ///< map -> id, of files that are no such map
  std::set<std::string> used_;
  std::vector<std::pair<std::string, std::string>> used_editions_;
  std::shared_ptr<const Edition> edition_used_, edition_followed_;
  std::thread thread_;
};

AtlasLoader::AtlasLoader(MapBytes files, Atlas atlas, const AtlasLoaderOptions& options, Changed changed)
    : impl_(std::make_unique<Impl>(std::move(files), std::move(atlas), options, std::move(changed))) {}
AtlasLoader::AtlasLoader(const std::string& folder, Atlas atlas, const AtlasLoaderOptions& options,
                         Changed changed)
    : AtlasLoader(mapFilesIn(folder), std::move(atlas), options, std::move(changed)) {}
AtlasLoader::~AtlasLoader() = default;
void AtlasLoader::want(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity) {
  impl_->want({position, velocity});
}
void AtlasLoader::setAtlas(Atlas atlas) { impl_->setAtlas(std::move(atlas)); }
std::shared_ptr<const AtlasField> AtlasLoader::field() const { return impl_->field(); }
AtlasLoaderStatus AtlasLoader::status() const { return impl_->status(); }
bool AtlasLoader::waitUntilSettled(double seconds) const { return impl_->waitUntilSettled(seconds); }

}  // namespace ttsdf
