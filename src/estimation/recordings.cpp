#include "estimation/recordings.hpp"

#include "base/error.hpp"
#include "capture/find_plane.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/fit_config.hpp"

namespace pliant {

namespace {

void require_fittable(const Capture& capture) {
  const auto refuse = [&](const std::string& found, const std::string& advice) {
    throw InputError({{capture.file}, found, "an object seen by depth cameras, clouds or markers", advice});
  };
  if (!capture.scene.object.surface) refuse("there is no scan of the object at rest", "add [object] surface");
  if (capture.depth.empty() && capture.clouds.empty() && capture.markers.empty())
    refuse("there are no depth cameras, no clouds and no markers", "");
  if (capture.scene.timing.is_static && capture.scene.fixed.empty() && capture.scene.planes.empty())
    refuse("the recording is static, but nothing holds the object",
           "add the [[fixed]] region that it hangs from, or the [[plane]] that it rests on");
  if (capture.scene.object.shape_is == ShapeIs::Static && capture.scene.fixed.empty())
    refuse("the scan was taken sagging (shape_is = \"static\"), and nothing holds the object",
           "add the [[fixed]] region that it hangs from");
  if (capture.scene.initial.released && capture.scene.fixed.empty())
    refuse("the object is released from a held, deformed pose, and nothing holds it afterwards",
           "add the [[fixed]] region where it stays held");
  if (!capture.scene.timing.is_static && capture.frame_count() - capture.scene.timing.start_frame < 2)
    refuse("fewer than two frames follow start_frame", "record longer");
}

/// Puts planes that are only roughly known where the depth images show them. Returns the numbers of those found.
std::vector<int> take_planes_from_images(Capture& capture) {
  std::vector<int> found;
  for (int i = 0; i < int(capture.scene.planes.size()); ++i) {
    Plane& plane = capture.scene.planes[std::size_t(i)];
    if (plane.known) continue;
    const auto seen = find_plane(capture, plane);
    if (!seen) continue;
    plane.point = seen->point;
    plane.normal = seen->normal;
    found.push_back(i);
  }
  return found;
}

/// Thousands of readings fix a visible plane; what is left is the sensor's bias and the softness of contact, about this
/// part of the object's size, and as many radians.
constexpr double seen_plane_std = 0.003;

void trust_planes_seen(ParameterSet& parameters, const std::vector<int>& planes) {
  std::vector<Parameter> list = parameters.parameters();
  for (Parameter& p : list)
    for (const int plane : planes)
      if (p.theta_index == theta::plane_point(plane)) p.prior_std = seen_plane_std;
  parameters = ParameterSet(std::move(list), parameters.reference());
}

/// The recordings' parameters side by side, those of the material once.
ParameterSet joined(const std::vector<ParameterSet>& sets) {
  std::vector<Parameter> list;
  Eigen::Index size = 0;
  for (const ParameterSet& set : sets) size += set.reference().size();
  VectorX theta(size);
  int offset = 0;
  for (std::size_t r = 0; r < sets.size(); ++r) {
    theta.segment(offset, sets[r].reference().size()) = sets[r].reference();
    for (Parameter p : sets[r].parameters()) {
      p.theta_index += offset;
      const auto same = std::ranges::find(list, p.name, &Parameter::name);
      if (is_material(p) && same != list.end()) {
        same->also.push_back(p.theta_index);
        if (p.name != "density") theta[p.theta_index] = theta[same->theta_index];
        continue;
      }
      if (r > 0) p.name += "[" + std::to_string(r + 1) + "]";
      list.push_back(std::move(p));
    }
    offset += int(sets[r].reference().size());
  }
  return {std::move(list), std::move(theta)};
}

}  // namespace

bool is_material(const Parameter& p) {
  return p.name.starts_with("youngs_modulus") || p.name == "poisson_ratio" || p.name == "mass_damping" ||
         p.name == "stiffness_damping" || p.name == "density";
}

int Recording::horizon(double part) const {
  if (capture.scene.timing.is_static) return last_frame;
  const int least = is_released() ? std::min(last_frame, 10) : std::max(1, last_frame / 3);
  return std::max(least, int(part * last_frame));
}

Recordings::Recordings(std::vector<RecordedCapture> recorded, const FitOptions& options,
                       std::vector<std::string>& notes)
    : options_(options) {
  std::vector<ParameterSet> sets;
  for (RecordedCapture& r : recorded) {
    all_.emplace_back();
    sets.push_back(make_ready(std::move(r), all_.back(), notes));
  }
  parameters_ = joined(sets);
  apply_overrides(parameters_, options_);
  int offset = 0;
  for (std::size_t r = 0; r < sets.size(); ++r) {
    all_[r].theta_offset = offset;
    all_[r].theta_size = int(sets[r].reference().size());
    offset += all_[r].theta_size;
  }
}

/// Everything of a recording that needs no parameters; returns those.
ParameterSet Recordings::make_ready(RecordedCapture recorded, Recording& recording, std::vector<std::string>& notes) {
  recording.capture = std::move(recorded.capture);
  Capture& capture = recording.capture;
  require_fittable(capture);
  const std::vector<int> planes_seen = take_planes_from_images(capture);
  for (const int plane : planes_seen)
    notes.push_back("Plane " + std::to_string(plane + 1) +
                    " is visible in the depth images; the fit starts from, and trusts, where it is seen there.");
  recording.tracked = recorded.followed ? std::move(*recorded.followed) : tracked_points(capture);
  recording.observations = std::make_shared<std::vector<FrameObservations>>(
      frame_observations(capture, recorded.observed, recording.tracked));
  if (recording.observations->empty())
    throw InputError({{capture.file},
                      "no frame shows any point of the object",
                      "depth images or clouds that see it",
                      "run `pliant check` on the capture to see what the cameras saw"});
  const int controls = capture.scene.regions.empty() ? options_.controls() : int(capture.scene.regions.size()) + 1;
  if (all_.size() > 1 && controls != controls_)
    throw InputError({{capture.file},
                      "the object has " + std::to_string(capture.scene.regions.size()) + " regions",
                      "those of the first recording, " + std::to_string(controls_ - 1),
                      "name the same materials in every recording of the object"});
  controls_ = controls;
  recording.size = object_size(capture.scene);
  recording.last_frame = std::min(int(capture.scene.timing.times.size()) - capture.scene.timing.start_frame - 1,
                                  recording.observations->back().frame);
  recording.distance = capture_distance(capture, widest_band());
  ParameterSet parameters =
      default_parameters(capture, enclosed_volume(*capture.scene.object.surface), controls_,
                         pull_count(capture.scene, resolution(0.0, options_.steps)), options_.scan_points);
  trust_planes_seen(parameters, planes_seen);
  return parameters;
}

double Recordings::widest_band() const { return std::max(options_.wide_band, options_.fine_band) * 1.25; }

Resolution Recordings::resolution(double cells, double steps) const {
  Resolution r;
  const bool moves_reference = any_sags() || options_.scan_points > 0;
  r.element = options_.element.value_or(moves_reference ? ElementKind::QuadraticTetrahedron : ElementKind::Hexahedron);
  if (moves_reference && r.element == ElementKind::Hexahedron)
    throw InputError({{front().capture.file},
                      any_sags() ? "the scan was taken sagging (shape_is = \"static\"), and element=hexahedra"
                                 : "scan_points are given, and element=hexahedra",
                      "tetrahedra: the grid of hexahedra is regular where the object is free of load",
                      "leave out element, or choose quadratic_tetrahedra"});
  r.shape_points = options_.scan_points;
  r.shape_std = options_.scan_std;
  r.field = {options_.controls(), options_.control_weights};
  r.cells = cells;
  r.steps = steps;
  r.pulls = options_.pull_points;
  r.band = widest_band();
  return r;
}

Grid Recordings::grid(double cells, double steps) const {
  SimulationOptions settings;
  settings.newmark_theta = options_.newmark_theta;
  settings.solver.kind = options_.solver;
  settings.solver.tolerance = options_.solver_tolerance;
  settings.hold_strongly = options_.hold_strongly;
  settings.integrator = options_.integrator;
  Grid grid{cells, steps, {}};
  for (const Recording& r : all_)
    grid.recording.push_back(discretise(r.capture, r.distance, resolution(cells, steps), r.own(parameters_.reference()),
                                        settings, r.tracked.rest));
  return grid;
}

ParameterSet Recordings::with_field_prior(ParameterSet parameters, const Grid& grid) const {
  const std::vector<Vector3>& points = grid.recording.front().control_points;
  if (points.size() > 1)
    parameters.set_joint_prior(modulus_names(front().capture, controls_),
                               field_precision(points, front().size, options_.modulus_variation));
  return parameters;
}

void Recordings::set_moduli(VectorX& theta, const VectorX& moduli) const {
  for (const Recording& r : all_) {
    VectorX own = r.own(theta);
    for (int k = 0; k < controls_; ++k) own[theta::modulus(k, controls_, own.size())] = moduli[k];
    theta.segment(r.theta_offset, r.theta_size) = own;
  }
}

}  // namespace pliant
