#include "common/messages.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace foresight {
namespace {

std::optional<Eigen::Quaterniond> read_rotation(const double wxyz[4]) {
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  if (!(std::abs(q.norm() - 1.0) < 1e-3)) return std::nullopt;
  return q;
}

std::vector<double> wxyz(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

// A map whose coordinates exceed this is broken: squares of them must not overflow.
constexpr double kMaxCoordinate_mu = 1e9;

// Starts a new part when the current one is full.
template <class Message>
class PartWriter {
 public:
  explicit PartWriter(size_t max_bytes) : max_bytes_(max_bytes), parts_(1) {}
  Message& room(size_t bytes) {
    if (used_ + bytes > max_bytes_) {
      parts_.emplace_back();
      used_ = 0;
    }
    used_ += bytes;
    return parts_.back();
  }
  std::vector<Message> finish() {
    for (size_t i = 0; i < parts_.size(); ++i) {
      parts_[i].header.part = static_cast<int32_t>(i);
      parts_[i].header.part_count = static_cast<int32_t>(parts_.size());
    }
    return std::move(parts_);
  }

 private:
  size_t max_bytes_;
  size_t used_ = 0;
  std::vector<Message> parts_;
};

void push_position(const Eigen::Vector3f& p, std::vector<float>* out) {
  out->insert(out->end(), {p.x(), p.y(), p.z()});
}

Eigen::Vector3f position_at(const std::vector<float>& xyz, size_t i) {
  return {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]};
}

bool all_non_negative(const std::vector<int32_t>& ids) {
  return std::all_of(ids.begin(), ids.end(), [](int32_t id) { return id >= 0; });
}

template <class IdType>
void append_ids(std::vector<IdType>* to, const std::vector<int32_t>& from) {
  for (const int32_t id : from) to->emplace_back(id);
}

constexpr int64_t kVotes = 6;  // numbers per cell

void push_votes(const CellVotes& votes, std::vector<int32_t>* to) {
  to->insert(to->end(), votes.entered.begin(), votes.entered.end());
  to->push_back(votes.started);
  to->push_back(votes.ended);
}

CellVotes votes_at(const std::vector<int32_t>& numbers, int32_t i) {
  const int32_t* v = &numbers[static_cast<size_t>(kVotes * i)];
  return {{v[0], v[1], v[2], v[3]}, v[4], v[5]};
}

template <class T>
int32_t count(const std::vector<T>& v) {
  return static_cast<int32_t>(v.size());
}

void set_counts(map_delta_t* m) {
  m->n_observations_removed = count(m->removed_observation_keyframe_ids);
  m->n_points_removed = count(m->removed_point_ids);
  m->n_keyframes_removed = count(m->removed_keyframe_ids);
  m->n_keyframes = count(m->keyframe_ids);
  m->n_points = count(m->point_ids);
  m->n_point_coordinates = count(m->point_positions_mu);
  m->n_observations = count(m->observation_keyframe_ids);
}

void set_counts(carving_delta_t* m) {
  m->n_cells_removed = count(m->removed_cell_ids);
  m->n_vertices_removed = count(m->removed_vertex_ids);
  m->n_vertices = count(m->vertex_ids);
  m->n_vertex_coordinates = count(m->vertex_positions_mu);
  m->n_cells = count(m->cell_ids);
  m->n_cell_vertices = count(m->cell_vertex_ids);
  m->n_cell_votes = count(m->cell_votes);
  m->n_updated_cell_votes = count(m->updated_cell_votes);
  m->n_cells_updated = count(m->updated_cell_ids);
  m->n_vertices_updated = count(m->updated_vertex_ids);
}

}  // namespace

camera_info_t to_message(const CameraModel& camera, Time time) {
  camera_info_t m{};
  m.utime = time.us;
  m.width_px = static_cast<int16_t>(camera.width_px);
  m.height_px = static_cast<int16_t>(camera.height_px);
  m.lens = camera.lens == LensModel::kRadtan ? camera_info_t::LENS_RADTAN
                                             : camera_info_t::LENS_EQUIDISTANT;
  m.fx_px = camera.fx_px;
  m.fy_px = camera.fy_px;
  m.cx_px = camera.cx_px;
  m.cy_px = camera.cy_px;
  std::copy(camera.distortion.begin(), camera.distortion.end(), m.distortion);
  return m;
}

namespace {

// What a lens can be, and a camera file may say (camera_file.cc): 16 to 8192 px, a centre within
// one image of the image, a focal length that is some angle, pixels that are nearly square, and
// numbers from which finite rays come.
bool makes_sense(const camera_info_t& m) {
  const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
  const double width = m.width_px, height = m.height_px;
  const bool known_lens =
      m.lens == camera_info_t::LENS_RADTAN || m.lens == camera_info_t::LENS_EQUIDISTANT;
  return known_lens && within(width, 16, 8192) && within(height, 16, 8192) &&
         within(m.fx_px, 1, 1e5) && within(m.fy_px, 1, 1e5) && within(m.fx_px / m.fy_px, 0.2, 5) &&
         within(m.cx_px, -width, 2 * width) && within(m.cy_px, -height, 2 * height) &&
         std::all_of(std::begin(m.distortion), std::end(m.distortion),
                     [&](double k) { return within(k, -100, 100); });
}

}  // namespace

std::optional<CameraModel> from_message(const camera_info_t& m) {
  if (!makes_sense(m)) return std::nullopt;
  CameraModel camera;
  camera.lens = m.lens == camera_info_t::LENS_RADTAN ? LensModel::kRadtan : LensModel::kEquidistant;
  camera.width_px = m.width_px;
  camera.height_px = m.height_px;
  camera.fx_px = m.fx_px;
  camera.fy_px = m.fy_px;
  camera.cx_px = m.cx_px;
  camera.cy_px = m.cy_px;
  std::copy(m.distortion, m.distortion + 5, camera.distortion.begin());
  camera.prepare();
  if (camera.max_radius <= 0) return std::nullopt;  // the lens folds at its very centre
  return camera;
}

namespace {

template <class Message>
void write_map_from_cam(const Pose<Map, Cam>& map_from_cam, Message* message) {
  const std::vector<double> q = wxyz(map_from_cam.rotation());
  std::copy(q.begin(), q.end(), message->map_from_cam_quat_wxyz);
  for (int i = 0; i < 3; ++i) {
    message->map_from_cam_position_mu[i] = map_from_cam.translation()[i];
  }
}

template <class Message>
std::optional<Pose<Map, Cam>> read_map_from_cam(const Message& message) {
  const auto rotation = read_rotation(message.map_from_cam_quat_wxyz);
  const Eigen::Vector3d position(message.map_from_cam_position_mu);
  if (!rotation || !(position.cwiseAbs().maxCoeff() <= kMaxCoordinate_mu)) return std::nullopt;
  return Pose<Map, Cam>(*rotation, position);
}

}  // namespace

void write_pose(const Pose<Map, Cam>& map_from_cam, camera_pose_t* message) {
  write_map_from_cam(map_from_cam, message);
}
void write_pose(const Pose<Map, Cam>& map_from_cam, pose_hint_t* message) {
  write_map_from_cam(map_from_cam, message);
}

std::optional<Pose<Map, Cam>> read_pose(const camera_pose_t& message) {
  if (message.state != camera_pose_t::STATE_TRACKING) return std::nullopt;
  return read_map_from_cam(message);
}
std::optional<Pose<Map, Cam>> read_pose(const pose_hint_t& message) {
  return read_map_from_cam(message);
}

std::vector<map_delta_t> split(const MapDelta& delta, size_t max_bytes) {
  PartWriter<map_delta_t> writer(max_bytes);
  for (const MapObservation& o : delta.observations_removed) {
    map_delta_t& m = writer.room(8);
    m.removed_observation_keyframe_ids.push_back(o.keyframe_id.value());
    m.removed_observation_point_ids.push_back(o.point_id.value());
  }
  for (const PointId id : delta.points_removed)
    writer.room(4).removed_point_ids.push_back(id.value());
  for (const KeyframeId id : delta.keyframes_removed) {
    writer.room(4).removed_keyframe_ids.push_back(id.value());
  }
  for (const MapKeyframe& k : delta.keyframes_set) {
    map_delta_t& m = writer.room(68);
    const Eigen::Vector3d& t = k.map_from_cam.translation();
    m.keyframe_ids.push_back(k.id.value());
    m.keyframe_utimes.push_back(k.time.us);
    m.keyframe_map_from_cam_quat_wxyz.push_back(wxyz(k.map_from_cam.rotation()));
    m.keyframe_map_from_cam_position_mu.push_back({t.x(), t.y(), t.z()});
  }
  for (const MapPoint& p : delta.points_set) {
    map_delta_t& m = writer.room(20);
    m.point_ids.push_back(p.id.value());
    push_position(p.position_in_map, &m.point_positions_mu);
    m.point_sigmas_mu.push_back(p.sigma_mu);
  }
  for (const MapObservation& o : delta.observations_added) {
    map_delta_t& m = writer.room(8);
    m.observation_keyframe_ids.push_back(o.keyframe_id.value());
    m.observation_point_ids.push_back(o.point_id.value());
  }
  std::vector<map_delta_t> parts = writer.finish();
  for (map_delta_t& m : parts) set_counts(&m);
  return parts;
}

bool append(const map_delta_t& part, MapDelta* delta) {
  if (part.n_point_coordinates != 3 * static_cast<int64_t>(part.n_points)) return false;
  for (const auto* ids :
       {&part.removed_observation_keyframe_ids, &part.removed_observation_point_ids,
        &part.removed_point_ids, &part.removed_keyframe_ids, &part.keyframe_ids, &part.point_ids,
        &part.observation_keyframe_ids, &part.observation_point_ids}) {
    if (!all_non_negative(*ids)) return false;
  }
  const auto is_sigma = [](float sigma) { return std::isfinite(sigma) && sigma >= 0; };
  if (!std::all_of(part.point_sigmas_mu.begin(), part.point_sigmas_mu.end(), is_sigma))
    return false;
  std::vector<MapKeyframe> keyframes;
  for (int32_t i = 0; i < part.n_keyframes; ++i) {
    const auto q = read_rotation(part.keyframe_map_from_cam_quat_wxyz[i].data());
    if (!q) return false;
    keyframes.push_back({KeyframeId(part.keyframe_ids[i]),
                         {*q, Eigen::Vector3d(part.keyframe_map_from_cam_position_mu[i].data())},
                         {part.keyframe_utimes[i]}});
  }
  delta->keyframes_set.insert(delta->keyframes_set.end(), keyframes.begin(), keyframes.end());
  for (int32_t i = 0; i < part.n_observations_removed; ++i) {
    delta->observations_removed.push_back({KeyframeId(part.removed_observation_keyframe_ids[i]),
                                           PointId(part.removed_observation_point_ids[i])});
  }
  append_ids(&delta->points_removed, part.removed_point_ids);
  append_ids(&delta->keyframes_removed, part.removed_keyframe_ids);
  for (int32_t i = 0; i < part.n_points; ++i) {
    delta->points_set.push_back({PointId(part.point_ids[i]),
                                 position_at(part.point_positions_mu, i),
                                 part.point_sigmas_mu[static_cast<size_t>(i)]});
  }
  for (int32_t i = 0; i < part.n_observations; ++i) {
    delta->observations_added.push_back(
        {KeyframeId(part.observation_keyframe_ids[i]), PointId(part.observation_point_ids[i])});
  }
  return true;
}

std::vector<carving_delta_t> split(const CarvingDelta& delta, size_t max_bytes) {
  PartWriter<carving_delta_t> writer(max_bytes);
  for (const CellId id : delta.cells_removed) writer.room(4).removed_cell_ids.push_back(id.value());
  for (const VertexId id : delta.vertices_removed) {
    writer.room(4).removed_vertex_ids.push_back(id.value());
  }
  for (const CarvingVertex& v : delta.vertices_set) {
    carving_delta_t& m = writer.room(24);
    m.vertex_ids.push_back(v.id.value());
    push_position(v.position_in_map, &m.vertex_positions_mu);
    m.vertex_observations.push_back(v.evidence.observations);
    m.vertex_spreads_rad.push_back(v.evidence.spread_rad);
  }
  for (const CarvingCell& c : delta.cells_added) {
    carving_delta_t& m = writer.room(48);
    m.cell_ids.push_back(c.id.value());
    for (const VertexId v : c.vertices) m.cell_vertex_ids.push_back(v.value());
    m.cell_constraints.push_back(c.constraints);
    push_votes(c.votes, &m.cell_votes);
  }
  for (const CarvingCellUpdate& u : delta.cells_updated) {
    carving_delta_t& m = writer.room(32);
    m.updated_cell_ids.push_back(u.id.value());
    m.updated_cell_constraints.push_back(u.constraints);
    push_votes(u.votes, &m.updated_cell_votes);
  }
  for (const CarvingVertexUpdate& u : delta.vertices_updated) {
    carving_delta_t& m = writer.room(12);
    m.updated_vertex_ids.push_back(u.id.value());
    m.updated_vertex_observations.push_back(u.evidence.observations);
    m.updated_vertex_spreads_rad.push_back(u.evidence.spread_rad);
  }
  std::vector<carving_delta_t> parts = writer.finish();
  for (carving_delta_t& m : parts) set_counts(&m);
  return parts;
}

bool append(const carving_delta_t& part, CarvingDelta* delta) {
  if (part.n_vertex_coordinates != 3 * static_cast<int64_t>(part.n_vertices)) return false;
  if (part.n_cell_vertices != 4 * static_cast<int64_t>(part.n_cells)) return false;
  if (part.n_cell_votes != kVotes * static_cast<int64_t>(part.n_cells)) return false;
  if (part.n_updated_cell_votes != kVotes * static_cast<int64_t>(part.n_cells_updated))
    return false;
  for (const auto* values :
       {&part.removed_cell_ids, &part.cell_ids, &part.cell_constraints, &part.updated_cell_ids,
        &part.updated_cell_constraints, &part.cell_votes, &part.updated_cell_votes}) {
    if (!all_non_negative(*values)) return false;
  }
  append_ids(&delta->cells_removed, part.removed_cell_ids);
  append_ids(&delta->vertices_removed, part.removed_vertex_ids);
  for (int32_t i = 0; i < part.n_vertices; ++i) {
    delta->vertices_set.push_back({VertexId(part.vertex_ids[i]),
                                   position_at(part.vertex_positions_mu, i),
                                   {part.vertex_observations[i], part.vertex_spreads_rad[i]}});
  }
  for (int32_t i = 0; i < part.n_cells; ++i) {
    const int32_t* v = &part.cell_vertex_ids[4 * static_cast<size_t>(i)];
    delta->cells_added.push_back({CellId(part.cell_ids[i]),
                                  {VertexId(v[0]), VertexId(v[1]), VertexId(v[2]), VertexId(v[3])},
                                  part.cell_constraints[i],
                                  votes_at(part.cell_votes, i)});
  }
  for (int32_t i = 0; i < part.n_cells_updated; ++i) {
    delta->cells_updated.push_back({CellId(part.updated_cell_ids[i]),
                                    part.updated_cell_constraints[i],
                                    votes_at(part.updated_cell_votes, i)});
  }
  for (int32_t i = 0; i < part.n_vertices_updated; ++i) {
    delta->vertices_updated.push_back(
        {VertexId(part.updated_vertex_ids[i]),
         {part.updated_vertex_observations[i], part.updated_vertex_spreads_rad[i]}});
  }
  return true;
}

mesh_t to_message(const Mesh& mesh) {
  mesh_t m{};
  for (const Eigen::Vector3f& v : mesh.vertices_in_map) push_position(v, &m.vertex_positions_mu);
  for (const VertexId id : mesh.vertex_ids) m.vertex_ids.push_back(id.value());
  m.vertex_confidences = mesh.confidences;
  for (const auto& t : mesh.triangles) {
    m.triangle_vertices.insert(m.triangle_vertices.end(), t.begin(), t.end());
  }
  m.n_vertices = count(mesh.vertices_in_map);
  m.n_vertex_coordinates = count(m.vertex_positions_mu);
  m.n_triangles = count(mesh.triangles);
  m.n_triangle_vertices = count(m.triangle_vertices);
  return m;
}

std::optional<Mesh> from_message(const mesh_t& m) {
  if (m.n_vertex_coordinates != 3 * static_cast<int64_t>(m.n_vertices)) return std::nullopt;
  if (m.n_triangle_vertices != 3 * static_cast<int64_t>(m.n_triangles)) return std::nullopt;
  for (int32_t v : m.triangle_vertices) {
    if (v < 0 || v >= m.n_vertices) return std::nullopt;
  }
  Mesh mesh;
  append_ids(&mesh.vertex_ids, m.vertex_ids);
  mesh.confidences = m.vertex_confidences;
  for (int32_t i = 0; i < m.n_vertices; ++i) {
    mesh.vertices_in_map.push_back(position_at(m.vertex_positions_mu, i));
  }
  for (size_t i = 0; i + 2 < m.triangle_vertices.size(); i += 3) {
    const int32_t* v = &m.triangle_vertices[i];
    mesh.triangles.push_back({v[0], v[1], v[2]});
  }
  return mesh;
}

}  // namespace foresight
