#include "estimation/recordings.hpp"

#include <fmt/format.h>

#include <cmath>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/profile.hpp"
#include "capture/find_plane.hpp"
#include "capture/markers.hpp"
#include "capture/pixel_scatter.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/judgement.hpp"
#include "estimation/press_objective.hpp"
#include "estimation/scan_errors.hpp"
#include "estimation/sensor_poses.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/random_field.hpp"
#include "geometry/solid_surface.hpp"
#include "simulation/flat_sheet.hpp"

namespace pliant {

namespace {

bool has_fitted_loads(const Capture& capture) {
  return std::ranges::any_of(capture.loads, [](const Load& load) { return is_fitted(load.role); });
}

/// Whether presses, curves or grips of a capture are to be fitted.
bool has_pressed(const Capture& capture) {
  return has_static_tests_to_fit(capture) ||
         std::ranges::any_of(capture.presses, [](const Press& press) { return is_fitted(press.role); });
}

void require_fittable(const Capture& capture, const FitOptions& options) {
  const auto refuse = [&](const std::string& found, const std::string& advice) {
    throw InputError(
        {{capture.file}, found, "an object seen by depth cameras, silhouettes, clouds or markers", advice});
  };
  if (options.material == MaterialKind::Sampled)
    throw InputError({{capture.file},
                      "the object moves or hangs, and material=sampled",
                      "material=linear, neo_hookean or ogden: stiffness is sampled under presses alone",
                      "leave out material, or fit a capture that has nothing but presses"});
  if (!capture.scene.object.surface) refuse("there is no scan of the object at rest", "add [object] surface");
  if (capture.depth.empty() && capture.silhouettes.empty() && capture.clouds.empty() && capture.markers.empty() &&
      !has_fitted_loads(capture) && !has_pressed(capture))
    refuse("there are no depth cameras, no silhouettes, no clouds and no markers", "");
  if (has_fitted_loads(capture) && !capture.scene.is_held() && !capture.scene.is_touched())
    refuse("weights hang from the object, but nothing holds it",
           "add the [[fixed]] region that it hangs from, or the [[plane]] that it rests on");
  if (capture.scene.timing.is_static && !capture.scene.is_held() && !capture.scene.is_touched())
    refuse("the recording is static, but nothing holds the object",
           "add the [[fixed]] region that it hangs from, or the [[plane]] that it rests on");
  if (capture.scene.object.shape_is == ShapeIs::Static && capture.scene.fixed.empty())
    refuse("the scan was taken sagging (shape_is = \"static\"), and nothing holds the object",
           "add the [[fixed]] region that it hangs from");
  if (capture.scene.initial.released && capture.scene.fixed.empty())
    refuse("the object is released from a held, deformed pose, and nothing holds it afterwards",
           "add the [[fixed]] region where it stays held");
  if (!capture.scene.timing.is_static && capture.scene.timing.frame_count() - capture.scene.timing.start_frame < 2)
    refuse("fewer than two frames follow start_frame", "record longer");
}

/// Standard deviation of a scan along its normals [m]: what the capture states or, where it states nothing and the fit
/// does not estimate it, what scanners leave.
double scan_error(const Recording& recording, bool is_estimated) {
  if (const auto stated = recording.capture.scene.object.surface_noise) return *stated;
  if (is_estimated) return 0.0;
  return std::min(judgement.scan_error * recording.size, judgement.scan_error_of_thickness * recording.thickness);
}

/// Standard deviation of the logarithm of an object's stiffness from place to place: what the capture states or, where
/// it states nothing, what stuffing and foam have; 0 where the object has several moduli.
double unevenness(const Capture& capture, int controls) {
  return controls > 1 ? 0.0 : capture.scene.object.stiffness_std.value_or(judgement.unevenness);
}

ScanErrors scan_errors(const Recording& r, const std::vector<double>& coefficients) {
  return {*r.capture.scene.object.surface, r.scan_error, r.size, coefficients};
}

constexpr double stiffness_alike = 0.25;  // of the object's size: over so far stuffing and foam are as stiff

/// What was seen under a load, as the one frame of a recording.
LoadCase load_case(const Capture& capture, const Load& load, int points) {
  LoadCase one{load, {}, {}};
  std::vector<ObservedFrame> seen;
  if (load.markers) {
    const MarkerSet markers = read_marker_pair(*load.markers_rest, *load.markers);
    const double noise = 1e-3 * object_size(capture.scene);
    const int sensor = int(sensor_names(capture).size());  // beyond those whose errors are estimated
    for (int m = 0; m < markers.marker_count(); ++m) {
      one.tracked.rest.push_back(markers.rest.row(m).transpose());
      if (markers.is_seen(0, m))
        one.tracked.frames[capture.scene.timing.start_frame].push_back(
            {m, markers.frames[0].row(m).transpose(), noise, sensor});
    }
  } else {
    ObserveOptions options;
    options.max_points_per_frame = points;
    seen.push_back(observe_load(capture, load, options).seen);
    seen.back().frame = capture.scene.timing.start_frame;
  }
  one.observations = std::make_shared<std::vector<FrameObservations>>(frame_observations(capture, seen, one.tracked));
  return one;
}

/// Weighs depth readings by how far neighbours are seen to scatter where that is more than the noise that is stated or
/// that such sensors have. Returns of each depth camera the error that neighbours have in common [m]: nearly all of the
/// noise where they scatter far less than it says.
std::vector<double> weigh_by_scatter(const Capture& capture, std::vector<ObservedFrame>& observed,
                                     std::vector<std::string>& notes) {
  constexpr double clearly_more = 1.25, far_less = 1.0 / 3.0;
  std::vector<double> common(capture.depth.size(), 0.0);
  const std::vector<double> scatter = median_scatter(observed, capture.depth.size());
  for (std::size_t c = 0; c < scatter.size(); ++c) {
    if (scatter[c] == 0.0) continue;
    double squares = 0.0;
    int count = 0;
    for (ObservedFrame& frame : observed)
      for (std::size_t i = 0; i < frame.points.size(); ++i) {
        if (frame.camera[i] != int(c)) continue;
        squares += frame.noise[i] * frame.noise[i], ++count;
        if (scatter[c] > clearly_more) frame.noise[i] *= float(scatter[c]);
      }
    const double noise = std::sqrt(squares / count);
    const std::string& name = capture.depth[c].name;
    if (scatter[c] > clearly_more)
      notes.push_back(
          fmt::format("Neighbouring pixels of {} scatter by {:.2g} mm, {:.1f} times the noise {}; they are "
                      "weighed by what is seen.",
                      name, 1e3 * noise * scatter[c], scatter[c],
                      capture.depth[c].noise ? "that the capture states" : "of such cameras"));
    if (scatter[c] < far_less) {
      common[c] = noise * std::sqrt(1.0 - scatter[c] * scatter[c]);
      notes.push_back(
          fmt::format("Neighbouring pixels of {} scatter by {:.2g} mm only, where its noise is {:.2g} mm: "
                      "they err together, so its pose and the direction of gravity are taken to be known no "
                      "better than that.",
                      name, 1e3 * noise * scatter[c], 1e3 * noise));
    }
  }
  return common;
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

void trust_planes_seen(CaptureParameters& parameters, const std::vector<int>& planes) {
  std::vector<Parameter> list = parameters.set.parameters();
  for (Parameter& p : list)
    for (const int plane : planes)
      if (p.at == parameters.blocks.motion.planes[std::size_t(plane)].whole()) p.prior_std = seen_plane_std;
  parameters.set = ParameterSet(parameters.set.layout(), std::move(list), parameters.set.reference());
}

void take_sensors_as_exact(CaptureParameters& parameters) {
  std::vector<Parameter> list = parameters.set.parameters();
  for (Parameter& p : list) p.estimated = p.estimated && p.role != Role::Sensor;
  parameters.set = ParameterSet(parameters.set.layout(), std::move(list), parameters.set.reference());
}

bool is_shared(const ParameterBlock& block, bool shares_density) {
  return block.role == Role::Material || block.role == Role::Damping || (block.role == Role::Inertia && shares_density);
}

std::string suffix(std::size_t recording) { return recording == 0 ? "" : "[" + std::to_string(recording + 1) + "]"; }

/// Recordings of one object share a density where it is estimated or the user says something about it. Otherwise each
/// follows from its own capture's mass and scan.
bool shares_density(const std::vector<CaptureParameters>& recordings, const FitOptions& options) {
  const Parameter& density = *recordings.front().set.find("density");
  return density.estimated || options.parameters.contains(density.name);
}

/// The parameters of recordings in one vector, those of the object once.
ParameterSet joined(const std::vector<CaptureParameters>& recordings, const JointLayout& joint) {
  std::vector<Parameter> list;
  VectorX theta = VectorX::Zero(joint.layout.size());
  for (std::size_t r = recordings.size(); r-- > 0;) {  // the first one's values for what is shared
    const ParameterSet& own = recordings[r].set;
    for (std::size_t b = 0; b < own.layout().blocks().size(); ++b) {
      const ParameterHandle from = own.layout().handle(b),
                            to = joint.layout.at(joint.name_of(own.layout().blocks()[b].name, r));
      theta.segment(to.first, to.size) = own.reference().segment(from.first, from.size);
    }
  }
  for (std::size_t r = 0; r < recordings.size(); ++r)
    for (Parameter p : recordings[r].set.parameters()) {
      if (r > 0 && !joint.layout.contains(p.name + suffix(r))) {  // shared: what one recording tells is estimated
        const auto shared = std::ranges::find(list, joint.name_of(p.name, r), &Parameter::name);
        if (shared != list.end()) shared->estimated = shared->estimated || p.estimated;
        continue;
      }
      p.name = joint.name_of(p.name, r);
      p.at = joint.layout.at(p.name);
      list.push_back(std::move(p));
    }
  return {joint.layout, std::move(list), std::move(theta)};
}

/// An object that is released starts where its pulls hold it for these parameters; with the pulls themselves where they
/// hold it nowhere.
void start_in_pose(const VectorX& theta, ObservedMotion& motion) {
  if (motion.simulation.blocks.pulls.empty()) return;
  SimulationOptions held = motion.simulation;
  held.times.resize(1);
  Points pose;
  Simulation(motion.body, held).run(theta, [&](int, const State& state, auto) {
    pose = state.x;
    return false;
  });
  if (pose.rows() == 0) return;
  motion.simulation.blocks.pulls.clear();
  motion.simulation.start = std::move(pose);
}

/// All of the motion, as if its frames had been taken so many frames later.
void compare_later(const Recording& recording, int later, ObservedMotion& motion) {
  motion.options.last_frame = std::min(recording.last_seen, int(motion.simulation.times.size()) - 1);
  auto seen = std::make_shared<std::vector<FrameObservations>>();
  for (FrameObservations frame : *recording.observations) {
    frame.frame += later;
    if (frame.frame >= 0 && frame.frame <= motion.options.last_frame) seen->push_back(std::move(frame));
  }
  motion.observations = std::move(seen);
}

/// The first frame of a released object by points that were registered there: all of them are the object's.
void compare_pose(const Recording& recording, ObservedMotion& motion) {
  constexpr double far = 10.0;  // times the size: what is no outlier counts fully
  motion.observations =
      std::make_shared<std::vector<FrameObservations>>(frame_observations(recording.capture, {}, *recording.pose));
  motion.mismatch = {nullptr, std::make_shared<PointTracks>(*motion.body, recording.pose->rest), Vector3::Zero(), {}};
  motion.options.last_frame = 0;
  motion.options.outlier_scale = far * recording.size;
}

}  // namespace

std::string JointLayout::name_of(const std::string& block, std::size_t recording) const {
  return layout.contains(block + suffix(recording)) ? block + suffix(recording) : block;
}

VectorX JointLayout::part(const VectorX& theta, std::size_t recording) const {
  const ParameterLayout& alone = own[recording];
  return carry(layout, theta, alone, VectorX::Zero(alone.size()),
               [&](const std::string& name) { return name_of(name, recording); });
}

JointLayout join(const std::vector<CaptureParameters>& recordings, bool shares_density) {
  JointLayout joint;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const ParameterLayout& own = recordings[r].set.layout();
    for (ParameterBlock block : own.blocks()) {
      if (r > 0 && is_shared(block, shares_density)) continue;
      block.name += suffix(r);
      joint.layout.add(std::move(block));
    }
    joint.own.push_back(own);
    const auto there = [&](const ParameterHandle& handle) -> ParameterHandle {
      const std::string& name = own.block_of(handle).name;
      const ParameterHandle block = joint.layout.at(joint.name_of(name, r));
      return {block.first + handle.first - own.at(name).first, handle.size};
    };
    CaptureBlocks blocks{recordings[r].blocks.motion.moved(there), {}, {}};
    if (recordings[r].blocks.law) blocks.law = recordings[r].blocks.law->moved(there);
    for (const SensorBlocks& sensor : recordings[r].blocks.sensors) blocks.sensors.push_back(sensor.moved(there));
    joint.blocks.push_back(std::move(blocks));
  }
  return joint;
}

JointLayout joint_layout(const std::vector<RecordedCapture>& recordings, const FitOptions& options, int controls) {
  std::vector<CaptureParameters> parameters;
  Resolution resolution;
  resolution.pulls = options.pull_points;
  for (const RecordedCapture& r : recordings)
    parameters.push_back(default_parameters(r.capture, 1.0, controls, pull_count(r.capture.scene, resolution),
                                            options.scan_points, options.law_of_motion()));
  return join(parameters, shares_density(parameters, options));
}

VectorX with_moduli(const JointLayout& from, const VectorX& theta, const JointLayout& to, const VectorX& moduli) {
  VectorX changed = carry(from.layout, theta, to.layout, VectorX::Zero(to.layout.size()));
  const std::vector<ParameterHandle>& there = to.blocks.front().motion.youngs_moduli;
  for (std::size_t k = 0; k < there.size(); ++k) changed[there[k]] = moduli[Eigen::Index(k)];
  return changed;
}

int Recording::horizon(double part) const {
  if (capture.scene.timing.is_static) return last_frame;
  // Swings take their time, however little of them is compared.
  if (is_released()) return std::min(last_frame, std::max(10, int(part * last_seen)));
  return std::max({1, last_frame / 3, int(part * last_frame)});
}

namespace {

/// Whether the object is a sheet that hexahedra do not resolve, and has no elements of its own.
bool is_thin(const Recording& recording) {
  const Object& object = recording.capture.scene.object;
  return object.surface && !object.volume && is_thinner_than_hexahedra(recording.capture.scene);
}

}  // namespace

Recordings::Recordings(std::vector<RecordedCapture> recorded, const FitOptions& options,
                       std::vector<std::string>& notes)
    : options_(options) {
  std::vector<CaptureParameters> parameters;
  for (RecordedCapture& r : recorded) {
    all_.emplace_back();
    parameters.push_back(make_ready(std::move(r), all_.back(), notes));
  }
  if (!options_.element && std::ranges::any_of(all_, is_thin))
    notes.emplace_back(
        "The object is a flat sheet, thinner than hexahedra resolve: it is made of quadratic tetrahedra "
        "with one through the thickness.");
  const JointLayout joint = join(parameters, shares_density(parameters, options_));
  parameters_ = joined(parameters, joint);
  apply_overrides(parameters_, options_);
  for (std::size_t r = 0; r < all_.size(); ++r) all_[r].blocks = joint.blocks[r];
}

/// Everything of a recording that needs no parameters; returns those.
CaptureParameters Recordings::make_ready(RecordedCapture recorded, Recording& recording,
                                         std::vector<std::string>& notes) {
  recording.capture = std::move(recorded.capture);
  Capture& capture = recording.capture;
  if (capture.scene.timing.times.empty())
    capture.scene.timing.times = {0.0}, capture.scene.timing.is_static = true;  // loads and presses alone
  require_fittable(capture, options_);
  for (const Load& load : capture.loads)
    if (is_fitted(load.role)) recording.loads.push_back(load_case(capture, load, options_.points_per_frame));
  if (const Object& object = capture.scene.object; object.surface && !object.volume && is_file(object.file))
    for (const std::string& remark : mend(read_mesh(object.file)).remarks) notes.push_back("The scan: " + remark + ".");
  const std::vector<int> planes_found = take_planes_from_images(capture);
  for (const int plane : planes_found)
    notes.push_back("Plane " + std::to_string(plane + 1) +
                    " is visible in the depth images; the fit starts from, and trusts, where it is seen there.");
  recording.tracked = recorded.followed ? std::move(*recorded.followed) : tracked_points(capture);
  recording.pose = std::move(recorded.pose);
  recording.common_error = weigh_by_scatter(capture, recorded.observed, notes);
  recording.distance = capture_distance(capture, widest_band());
  // The tracker takes poses as they are, and so are the points that it followed.
  const bool has_sensors = !recorded.followed && estimates_sensors(capture);
  const bool stands = has_sensors && starts_as_scanned(capture.scene);
  std::vector<FrameObservations> observations =
      frame_observations(capture, recorded.observed, recording.tracked,
                         stands ? first_frame_at_rest(capture, recorded.observed, *recording.distance) : -1);
  if (has_sensors && !observations.empty()) observations.front().planes = planes_seen(capture, notes);
  recording.observations = std::make_shared<std::vector<FrameObservations>>(std::move(observations));
  if (recording.observations->empty() && recording.loads.empty() && !has_pressed(capture))
    throw InputError({{capture.file},
                      "no frame shows any point of the object",
                      "depth images or clouds that see it",
                      "run `pliant check` on the capture to see what the cameras saw"});
  const int controls = control_count(capture.scene, options_.controls());
  if (all_.size() > 1 && controls != controls_)
    throw InputError({{capture.file},
                      "the object has " + std::to_string(controls) + " moduli, by its regions or control points",
                      "those of the first recording, " + std::to_string(controls_),
                      "name the same materials in every recording of the object"});
  controls_ = controls;
  recording.size = object_size(capture.scene);
  recording.thickness = thickness(capture.scene, *recording.distance);
  recording.scan_error = scan_error(recording, options_.scan_points > 0);
  recording.unevenness = unevenness(capture, controls_);
  if (!recording.observations->empty())
    recording.last_frame = std::min(int(capture.scene.timing.times.size()) - capture.scene.timing.start_frame - 1,
                                    recording.observations->back().frame);
  recording.last_seen = recording.last_frame;
  if (options_.span > 0.0) recording.last_frame = std::max(1, int(options_.span * recording.last_frame));
  CaptureParameters parameters = default_parameters(capture, enclosed_volume(*capture.scene.object.surface), controls_,
                                                    pull_count(capture.scene, resolution(0.0, options_.steps)),
                                                    options_.scan_points, options_.law_of_motion());
  if (!has_sensors) trust_planes_seen(parameters, planes_found);
  if (recorded.followed) take_sensors_as_exact(parameters);
  return parameters;
}

double Recordings::widest_band() const { return std::max(options_.wide_band, options_.fine_band) * 1.25; }

Resolution Recordings::resolution(double cells, double steps) const {
  Resolution r;
  const bool has_law = options_.law_of_motion().has_value();
  // At rest what bends shows alone, and an equilibrium of quadratic elements costs a second.
  const bool wants_tetrahedra = moves_reference() || has_law || all_static() || std::ranges::any_of(all_, is_thin);
  r.element = options_.element.value_or(wants_tetrahedra ? ElementKind::QuadraticTetrahedron : ElementKind::Hexahedron);
  if (has_law && r.element == ElementKind::Hexahedron)
    throw InputError({{front().capture.file},
                      "a material law, and element=hexahedra",
                      "tetrahedra: hexahedra have one law in their mean strain",
                      "leave out element, or choose quadratic_tetrahedra; or leave out material"});
  if (moves_reference() && r.element == ElementKind::Hexahedron)
    throw InputError({{front().capture.file},
                      any_sags() ? "the scan was taken sagging (shape_is = \"static\"), and element=hexahedra"
                                 : "scan_points are given, and element=hexahedra",
                      "tetrahedra: the grid of hexahedra is regular in the stress-free reference configuration",
                      "leave out element, or choose quadratic_tetrahedra"});
  r.shape_points = options_.scan_points;
  r.shape_std = options_.scan_std;
  r.field = {options_.controls(), options_.control_weights};
  r.cells = cells;
  r.follows_thickness = true;
  r.steps = steps;
  r.pulls = options_.pull_points;
  r.band = widest_band();
  return r;
}

std::vector<CommonError> Recordings::common_errors() const {
  std::vector<CommonError> errors;
  for (const Recording& r : all_)
    for (std::size_t c = 0; c < r.common_error.size(); ++c)
      if (r.common_error[c] > 0.0) errors.push_back({r.blocks.sensors[c], r.common_error[c] / r.size});
  return errors;
}

GivenScale Recordings::given_scale() const {
  GivenScale scale;
  for (const Recording& r : all_)
    scale.deviation = std::max(scale.deviation, r.capture.scene.object.scale_std.value_or(0.0));
  scale.masses_are_known = front().capture.scene.object.mass.has_value() || parameters_.find("density")->estimated;
  return scale;
}

/// A recording of an object whose surface is off its scan. Hexahedra are those of that surface, or of one near
/// another's on the lattice of that; tetrahedra are those of the scan, moved.
/// @param own  with the errors as its offset
Discretisation Recordings::off_scan(const Recording& r, Resolution own, const SimulationOptions& settings,
                                    const std::vector<double>& errors, const Grid* about,
                                    const Discretisation* beside) const {
  if (own.element != ElementKind::Hexahedron || r.capture.scene.object.volume)
    return discretise(r.capture, r.distance, own, r.blocks, parameters_.reference(), settings, r.tracked.rest);
  std::vector<double> from = about ? about->change.scan_errors : errors, more = errors;
  from.resize(errors.size());
  for (std::size_t k = 0; k < more.size(); ++k) more[k] -= from[k];
  own.offset = scan_errors(r, from);
  Capture off = r.capture;
  TriangleMesh& surface = off.scene.object.surface.emplace(surface_of(r.capture.scene, own));
  if (off.scene.object.mass)
    own.relative_density = enclosed_volume(*r.capture.scene.object.surface) / enclosed_volume(surface);
  own.offset = nullptr;
  if (beside) own.offset = scan_errors(r, more);
  Discretisation d = discretise(off, beside ? beside->distance : capture_distance(off, widest_band()), own, r.blocks,
                                parameters_.reference(), settings, r.tracked.rest);
  if (!beside) d.surface = std::move(surface);
  return d;
}

Grid Recordings::grid(double cells, double steps, const ModelChange& change, const Grid* about) const {
  const Timed timed(Activity::Meshing);
  SimulationOptions settings;
  settings.newmark_theta = options_.newmark_theta;
  settings.solver.kind = options_.solver;
  settings.solver.tolerance = options_.solver_tolerance;
  settings.solver.derivative_tolerance =
      1e3 * options_.solver_tolerance;  // derivatives lead to the minimum, they do not move it
  settings.hold_strongly = options_.hold_strongly;
  settings.integrator = options_.integrator;
  if (options_.material == MaterialKind::Linear || change.small_strain)
    settings.material.elastic = ElasticLaw::Corotated;
  if (options_.damping == StiffnessDamping::Rayleigh || change.small_strain)
    settings.material.damping = StiffnessDamping::Rayleigh;
  Grid grid{cells, steps, change, {}, {}};
  for (const Recording& r : all_) {
    Resolution own = resolution(cells, steps);
    if (change.unevenness != 0 && r.unevenness > 0.0)
      own.unevenness =
          RandomField(part_of_unevenness * r.unevenness, stiffness_alike * r.size, std::uint64_t(change.unevenness));
    if (r.scan_error > 0.0 && !change.scan_errors.empty()) {
      const Discretisation* beside = about ? &about->recording[grid.recording.size()] : nullptr;
      own.offset = scan_errors(r, change.scan_errors);
      grid.recording.push_back(off_scan(r, own, settings, change.scan_errors, about, beside));
    } else {
      grid.recording.push_back(
          discretise(r.capture, r.distance, own, r.blocks, parameters_.reference(), settings, r.tracked.rest));
    }
    grid.presses.push_back(press_scene(r, grid.recording.back(), own));
  }
  return grid;
}

/// The presses of a recording around its own body, or, where that is of hexahedra, around one of tetrahedra as large.
std::shared_ptr<const PressScene> Recordings::press_scene(const Recording& recording, const Discretisation& d,
                                                          const Resolution& resolution) const {
  const Capture& capture = recording.capture;
  if (!has_pressed(capture)) return nullptr;
  auto body = d.body;
  if (body->kind == ElementKind::Hexahedron) {
    Resolution tetrahedra = resolution;
    tetrahedra.element = ElementKind::Tetrahedron;
    std::vector<Vector3> control_points;
    body = make_body_of(capture.scene, *recording.distance, tetrahedra, control_points);
  }
  return std::make_shared<PressScene>(make_press_scene(capture, std::move(body)));
}

Objective Recordings::objective(const Grid& grid, const ParameterSet& parameters, const Compared& compared,
                                const std::function<bool()>& interrupted,
                                const std::shared_ptr<ProcessGroup>& processes) const {
  std::vector<std::unique_ptr<Trial>> trials;
  // How the motion begins says nothing about what stands still.
  const std::vector<const Parameter*> estimated = parameters.coordinate_parameters();
  const bool has_statics =
      estimated.empty() || std::ranges::any_of(estimated, [](const Parameter* p) { return is_of_object(*p); });
  std::vector<ObjectiveOptions> options;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const Recording& r = all_[i];
    const Discretisation& d = grid.recording[i];
    ObjectiveOptions o;
    o.outlier_scale = compared.band * r.size;
    o.last_frame = std::min(r.last_frame, compared.last_frame(r));
    o.interrupted = interrupted;
    o.keeps_rows = compared.keeps_rows;
    options.push_back(o);
    ObservedMotion motion{d.mismatch, d.body, d.simulation, r.observations, o};
    if (compared.later && !d.simulation.is_static) compare_later(r, *compared.later, motion);
    if (compared.by_pose && r.pose) compare_pose(r, motion);
    if (compared.pose_of.size() > 0) start_in_pose(compared.pose_of, motion);
    trials.push_back(std::make_unique<MotionTrial>(std::move(motion), int(i)));
  }
  for (std::size_t i = 0; i < all_.size() && has_statics; ++i) {
    add_loads(all_[i], grid.recording[i], options[i], trials);
    if (grid.presses[i]) add_presses(all_[i], grid.recording[i], grid.presses[i], parameters, trials);
  }
  return {std::move(trials), with_field_prior(parameters, grid), processes};
}

void Recordings::add_loads(const Recording& recording, const Discretisation& d, const ObjectiveOptions& options,
                           std::vector<std::unique_ptr<Trial>>& trials) const {
  for (const LoadCase& load : recording.loads) {
    ObservedMotion at_rest{d.mismatch, d.body, d.simulation, load.observations, options};
    at_rest.simulation.is_static = true;
    at_rest.simulation.times = {0.0};
    at_rest.simulation.loads.push_back({load.load.at, load.load.mass});
    at_rest.simulation.released_weights.clear();
    at_rest.options.last_frame = 0;
    at_rest.mismatch.tracks =
        load.tracked.rest.empty() ? nullptr : std::make_shared<PointTracks>(*d.body, load.tracked.rest);
    trials.push_back(std::make_unique<MotionTrial>(std::move(at_rest), int(trials.size())));
  }
}

void Recordings::add_presses(const Recording& recording, const Discretisation& d,
                             const std::shared_ptr<const PressScene>& scene, const ParameterSet& parameters,
                             std::vector<std::unique_ptr<Trial>>& trials) const {
  constexpr double least_noise = 1e-4;  // times the object's size
  const LawLayout law = recording.blocks.law
                            ? *recording.blocks.law
                            : LawLayout::of_moduli(recording.blocks.motion, *d.simulation.material.of_mean_strain());
  const auto material = std::make_shared<PressedMaterial>(scene->body, law);
  for (std::size_t i = 0; i < scene->presses.size(); ++i) {
    const ObservedPress& seen = scene->presses[i];
    if (!is_fitted(seen.role)) continue;
    const double noise = options_.marker_noise > 0.0 ? options_.marker_noise
                                                     : std::max(marker_noise(seen), least_noise * recording.size);
    trials.push_back(std::make_unique<PressTrial>(scene, int(i), material, parameters.reference(),
                                                  PressTrialOptions{noise, judgement.press_outlier},
                                                  int(trials.size())));
  }
  for (std::unique_ptr<Trial>& test : static_test_trials(scene, material, parameters, int(trials.size())))
    trials.push_back(std::move(test));
}

ParameterSet Recordings::with_field_prior(ParameterSet parameters, const Grid& grid) const {
  const std::vector<Vector3>& points = grid.recording.front().control_points;
  if (points.size() > 1)
    parameters.set_joint_prior(modulus_names(front().capture, controls_),
                               field_precision(points, front().size, options_.modulus_variation));
  return parameters;
}

std::vector<std::string> Recordings::told_at_rest() const {
  constexpr int fewest = 50;  // points of the object that a sensor sees
  std::vector<std::string> names;
  for (const Recording& r : all_) {
    const bool stands = starts_as_scanned(r.capture.scene) && estimates_sensors(r.capture) &&
                        !r.observations->empty() && r.observations->front().frame == 0;
    if (!stands) continue;
    std::vector<int> seen(r.blocks.sensors.size(), 0);
    for (const SurfaceObservation& o : r.observations->front().points) ++seen[std::size_t(o.sensor)];
    for (const OutlineObservation& o : r.observations->front().outlines)
      seen[std::size_t(o.sensor)] += int(o.points.size());
    std::vector<ParameterHandle> told;
    for (std::size_t k = 0; k < seen.size(); ++k)
      if (seen[k] >= fewest)
        for (const ParameterHandle& block : r.blocks.sensors[k].all()) told.push_back(block);
    if (told.empty()) continue;
    for (const PlaneBlock& plane : r.blocks.motion.planes) told.push_back(plane.whole());
    for (const Parameter& p : parameters_.parameters())
      if (p.estimated && std::ranges::find(told, p.at) != told.end()) names.push_back(p.name);
  }
  return names;
}

void Recordings::set_moduli(VectorX& theta, const VectorX& moduli) const {
  for (int k = 0; k < controls_; ++k) theta[material().youngs_moduli[std::size_t(k)]] = moduli[k];
}

}  // namespace pliant
